#!/bin/sh
# Builds the library and installs it: headers, shared and static library, pkg-config file.
#
#     crates/ffi/install.sh [PREFIX]        default: /usr/local; DESTDIR is put before it
set -eu
prefix=${1:-/usr/local}
root="${DESTDIR:-}$prefix"
cd "$(dirname "$0")"

cargo build --release -p selvedge-ffi
target=$(cargo metadata --format-version 1 --no-deps | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' ../../Cargo.toml | head -n 1)
case $(uname) in
  Darwin) shared=libselvedge.dylib ;;
  *) shared=libselvedge.so ;;
esac

mkdir -p "$root/include" "$root/lib/pkgconfig"
install -m 644 include/selvedge.h include/selvedge.hpp "$root/include"
install -m 644 "$target/release/libselvedge.a" "$root/lib"
install -m 755 "$target/release/$shared" "$root/lib"
cat >"$root/lib/pkgconfig/selvedge.pc" <<EOF
prefix=$prefix
libdir=\${prefix}/lib
includedir=\${prefix}/include

Name: selvedge
Description: Woven-cloth shading from WIF drafts
Version: $version
Libs: -L\${libdir} -lselvedge
Libs.private: -lpthread -ldl -lm
Cflags: -I\${includedir}
EOF
