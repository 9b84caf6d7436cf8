// selvedge.h for C++17: the same calls, with owners that free what they hold and exceptions for
// statuses. Threads, frames and units are those of selvedge.h.

#ifndef SELVEDGE_HPP
#define SELVEDGE_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "selvedge.h"

namespace selvedge {

using Vec2 = std::array<double, 2>;
using Vec3 = std::array<float, 3>;

// A call that failed: why, and its status.
class Error : public std::runtime_error {
public:
    Error(std::uint32_t status, const std::string &reason)
        : std::runtime_error(reason.empty() ? "status " + std::to_string(status) : reason),
          status_(status) {}
    std::uint32_t status() const noexcept { return status_; }

private:
    std::uint32_t status_;
};

namespace detail {

// Calls `function(message, message_size)` and throws unless it returns SELVEDGE_STATUS_OK.
template <typename Function> void check(Function &&function) {
    char message[1024] = "";
    const auto status = static_cast<std::uint32_t>(function(message, sizeof message));
    if (status != 0)
        throw Error(status, message);
}

template <typename Function> std::string text(Function &&function) {
    std::size_t length = 0;
    check([&](char *, std::size_t) { return function(nullptr, 0, &length); });
    std::string text(length + 1, '\0');
    check([&](char *, std::size_t) { return function(&text[0], text.size(), &length); });
    text.resize(length);
    return text;
}

template <typename T, void (*free_it)(T *)> struct Free {
    void operator()(T *owned) const noexcept { free_it(owned); }
};

} // namespace detail

// Whether the library has what this header was written for.
inline bool fits() noexcept {
    const std::uint32_t abi = selvedge_abi_version();
    constexpr std::uint32_t expected = SELVEDGE_ABI_VERSION;
    return abi >> 16 == expected >> 16 && abi >= expected;
}

// A struct that knows its size, all else 0.
template <typename T> T sized() noexcept {
    T value{};
    value.struct_size = sizeof(T);
    return value;
}

class Draft {
public:
    Draft(const void *bytes, std::size_t length) {
        make([&](char *m, std::size_t n, selvedge_draft **draft) {
            return selvedge_draft_new(static_cast<const std::uint8_t *>(bytes), length, m, n, draft);
        });
    }
    explicit Draft(const selvedge_pattern &pattern) {
        make([&](char *m, std::size_t n, selvedge_draft **draft) {
            return selvedge_draft_from_pattern(&pattern, m, n, draft);
        });
    }
    static Draft load(const std::string &path) { return Draft(path); }
    std::string warnings() const {
        return detail::text([&](char *text, std::size_t size, std::size_t *length) {
            return selvedge_draft_warnings(get(), text, size, length);
        });
    }
    const selvedge_draft *get() const noexcept { return draft_.get(); }

private:
    explicit Draft(const std::string &path) {
        make([&](char *m, std::size_t n, selvedge_draft **draft) {
            return selvedge_draft_load(path.c_str(), m, n, draft);
        });
    }
    template <typename Function> void make(Function &&function) {
        selvedge_draft *draft = nullptr;
        detail::check([&](char *m, std::size_t n) { return function(m, n, &draft); });
        draft_.reset(draft);
    }
    std::unique_ptr<selvedge_draft, detail::Free<selvedge_draft, selvedge_draft_free>> draft_;
};

class Fabric {
public:
    explicit Fabric(const Draft &draft, const std::string &json = "{}") {
        make([&](char *m, std::size_t n, selvedge_fabric **fabric) {
            return selvedge_fabric_new(draft.get(), json.data(), json.size(), m, n, fabric);
        });
    }
    // Of the fabric or draft in a file.
    static Fabric load(const std::string &path) { return Fabric(path); }
    selvedge_fabric_info info() const {
        auto info = sized<selvedge_fabric_info>();
        detail::check([&](char *m, std::size_t n) {
            return selvedge_fabric_describe(get(), m, n, &info);
        });
        return info;
    }
    std::array<double, 3> value(std::uint32_t yarn, const std::string &name) const {
        std::array<double, 3> value{};
        const std::uint32_t index = find(name);
        detail::check([&](char *m, std::size_t n) {
            return selvedge_fabric_value(get(), yarn, index, m, n, value.data());
        });
        return value;
    }
    void set_value(std::uint32_t yarn, const std::string &name, std::array<double, 3> value) {
        const std::uint32_t index = find(name);
        detail::check([&](char *m, std::size_t n) {
            return selvedge_fabric_set_value(get(), yarn, index, value.data(), m, n);
        });
    }
    selvedge_fabric *get() const noexcept { return fabric_.get(); }

private:
    explicit Fabric(const std::string &path) {
        make([&](char *m, std::size_t n, selvedge_fabric **fabric) {
            return selvedge_fabric_load(path.c_str(), m, n, fabric);
        });
    }
    static std::uint32_t find(const std::string &name) {
        std::uint32_t index = 0;
        detail::check([&](char *m, std::size_t n) {
            return selvedge_parameter_find(name.c_str(), m, n, &index);
        });
        return index;
    }
    template <typename Function> void make(Function &&function) {
        selvedge_fabric *fabric = nullptr;
        detail::check([&](char *m, std::size_t n) { return function(m, n, &fabric); });
        fabric_.reset(fabric);
    }
    std::unique_ptr<selvedge_fabric, detail::Free<selvedge_fabric, selvedge_fabric_free>> fabric_;
};

// A copy is one more owner of the same shader.
class Shader {
public:
    struct Sample {
        Vec3 wi, weight;
        float pdf;
    };

    explicit Shader(const Fabric &fabric) {
        const selvedge_shader *shader = nullptr;
        detail::check([&](char *m, std::size_t n) {
            return selvedge_shader_new(fabric.get(), m, n, &shader);
        });
        shader_ = shader;
    }
    Shader(const Shader &other) noexcept : shader_(other.shader_) { selvedge_shader_share(shader_); }
    Shader(Shader &&other) noexcept : shader_(std::exchange(other.shader_, nullptr)) {}
    Shader &operator=(Shader other) noexcept {
        std::swap(shader_, other.shader_);
        return *this;
    }
    ~Shader() { selvedge_shader_free(shader_); }

    Vec3 eval(const Vec2 &uv, const Vec3 &wi, const Vec3 &wo, float footprint = 0) const {
        Vec3 f{};
        check(selvedge_shader_eval(shader_, uv.data(), footprint, wi.data(), wo.data(), f.data()));
        return f;
    }
    float pdf(const Vec2 &uv, const Vec3 &wi, const Vec3 &wo, float footprint = 0) const {
        float pdf = 0;
        check(selvedge_shader_pdf(shader_, uv.data(), footprint, wi.data(), wo.data(), &pdf));
        return pdf;
    }
    Sample sample(const Vec2 &uv, const Vec3 &wo, const Vec3 &xi, float footprint = 0) const {
        Sample drawn{};
        check(selvedge_shader_sample(shader_, uv.data(), footprint, wo.data(), xi.data(),
                                     drawn.wi.data(), drawn.weight.data(), &drawn.pdf));
        return drawn;
    }
    Vec3 albedo(const Vec2 &uv, const Vec3 &wo, float footprint = 0) const {
        Vec3 albedo{};
        check(selvedge_shader_albedo(shader_, uv.data(), footprint, wo.data(), albedo.data()));
        return albedo;
    }
    float opacity(const Vec2 &uv, float footprint = 0) const {
        float opacity = 0;
        check(selvedge_shader_opacity(shader_, uv.data(), footprint, &opacity));
        return opacity;
    }
    selvedge_yarn_point yarn_at(const Vec2 &uv) const {
        auto point = sized<selvedge_yarn_point>();
        check(selvedge_shader_yarn_at(shader_, uv.data(), &point));
        return point;
    }
    void eval(const selvedge_points &points, const selvedge_vectors_out &f) const {
        detail::check([&](char *m, std::size_t n) {
            return selvedge_shader_eval_batch(shader_, &points, m, n, &f);
        });
    }
    std::string warnings() const {
        return detail::text([&](char *text, std::size_t size, std::size_t *length) {
            return selvedge_shader_warnings(shader_, text, size, length);
        });
    }
    const selvedge_shader *get() const noexcept { return shader_; }

private:
    static void check(selvedge_status status) {
        if (status != SELVEDGE_STATUS_OK)
            throw Error(static_cast<std::uint32_t>(status), "");
    }
    const selvedge_shader *shader_ = nullptr;
};

} // namespace selvedge

#endif // SELVEDGE_HPP
