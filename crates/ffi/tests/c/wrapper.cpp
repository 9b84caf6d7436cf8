// The C++ header: owners, copies, exceptions; eight threads share a shader and each makes its own. The
// argument is the path of a draft.

#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "selvedge.hpp"

#define CHECK(condition)                                                         \
    do {                                                                         \
        if (!(condition)) {                                                      \
            std::fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
            std::exit(1);                                                        \
        }                                                                        \
    } while (0)

static const selvedge::Vec3 wi{0.6f, 0.0f, 0.8f}, wo{0.0f, 0.6f, 0.8f};

static selvedge::Vec2 position(int step) { return {1.3e-5 * step, 3.1e-5 * step}; }

static void shares(const selvedge::Shader &shader, const selvedge::Fabric &fabric) {
    const selvedge::Shader owner = shader, own(fabric);
    for (int step = 0; step < 500; step++) {
        const auto f = owner.eval(position(step), wi, wo);
        CHECK(f == own.eval(position(step), wi, wo) && f[0] >= 0.0f);
        const auto drawn = own.sample(position(step), wo, {0.3f, 0.6f, 0.1f});
        CHECK(drawn.pdf == 0.0f || drawn.pdf == own.pdf(position(step), drawn.wi, wo));
    }
}

int main(int argc, char **argv) {
    CHECK(argc == 2 && selvedge::fits());
    auto fabric = selvedge::Fabric::load(argv[1]);
    fabric.set_value(0, "psi", {0.4, 0.0, 0.0});
    CHECK(fabric.value(0, "psi")[0] == 0.4 && fabric.info().ends > 0);

    try {
        fabric.set_value(0, "psi", {9.0, 0.0, 0.0});
        CHECK(false);
    } catch (const selvedge::Error &error) {
        CHECK(error.status() == SELVEDGE_STATUS_INVALID_ARGUMENT);
        CHECK(std::string(error.what()).find("psi: 9, expected") == 0);
    }
    try {
        selvedge::Draft("no draft", 8);
        CHECK(false);
    } catch (const selvedge::Error &error) {
        CHECK(error.status() == SELVEDGE_STATUS_INVALID_DRAFT);
    }

    selvedge::Shader shader(fabric);
    std::vector<std::thread> threads;
    for (int i = 0; i < 8; i++)
        threads.emplace_back([&] { shares(shader, fabric); });
    for (auto &thread : threads)
        thread.join();

    std::vector<float> f(3 * 500);
    std::vector<double> uv;
    for (int step = 0; step < 500; step++)
        for (double x : position(step))
            uv.push_back(x);
    auto points = selvedge::sized<selvedge_points>();
    points.count = 500;
    points.uv = {{uv.data(), uv.data() + 1}, 2 * sizeof(double)};
    points.wi = {{&wi[0], &wi[1], &wi[2]}, 0};
    points.wo = {{&wo[0], &wo[1], &wo[2]}, 0};
    shader.eval(points, {{f.data(), f.data() + 1, f.data() + 2}, 3 * sizeof(float)});
    for (int step = 0; step < 500; step++)
        CHECK(shader.eval(position(step), wi, wo)[1] == f[static_cast<std::size_t>(3 * step + 1)]);

    const auto point = shader.yarn_at(position(7));
    CHECK(point.kind != SELVEDGE_YARN_KIND_GAP && shader.opacity(position(7)) == 1.0f);
    CHECK(shader.albedo(position(7), wo)[0] > 0.0f);
    const selvedge::Shader moved = std::move(shader);
    shader = moved;
    CHECK(shader.get() == moved.get() && moved.warnings().empty());
    const auto draft = selvedge::Draft::load(argv[1]);
    CHECK(selvedge::Fabric(draft, "{\"scale\": 2}").value(0, "scale")[0] == 2.0);
    CHECK(draft.warnings().empty());
    return 0;
}
