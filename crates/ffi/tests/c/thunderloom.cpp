// As C++.
#include "thunderloom.c"
