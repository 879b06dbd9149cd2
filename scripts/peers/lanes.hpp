// Functions of one number without branches and calls, which the compiler vectorises.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

constexpr int LANES = 16;

// One number for each ray of a packet.
struct alignas(64) Lanes {
    float at[LANES];
    float& operator[](int lane) { return at[lane]; }
    float operator[](int lane) const { return at[lane]; }
};

struct Colors {
    Lanes r, g, b;
};

template <class To, class From>
inline To bits(From from) {
    static_assert(sizeof(To) == sizeof(From));
    To to;
    std::memcpy(&to, &from, sizeof to);
    return to;
}

// Of a positive number, within 3e-6.
inline float log2_of(float x) {
    const int32_t raw = bits<int32_t>(x);
    const float exponent = float((raw >> 23) - 127);
    const float m = bits<float>((raw & 0x007fffff) | 0x3f800000) - 1.0f;
    float p = 0.02001665f;
    p = p * m - 0.0946268097f;
    p = p * m + 0.213943212f;
    p = p * m - 0.338377198f;
    p = p * m + 0.477496364f;
    p = p * m - 0.721144092f;
    p = p * m + 1.44269298f;
    return exponent + m * p;
}

// Of a number from -126 to 127, within 2e-7 of the result.
inline float exp2_of(float x) {
    const float whole = std::floor(x);
    const float f = x - whole;
    float p = 0.00189375406f;
    p = p * f + 0.00894959042f;
    p = p * f + 0.0558603371f;
    p = p * f + 0.240141818f;
    p = p * f + 0.69315449f;
    p = p * f + 0.999999898f;
    return p * bits<float>((int32_t(whole) + 127) << 23);
}

// Of a base in [0, 1].
inline float power(float base, float exponent) {
    const float log = log2_of(base > 1e-30f ? base : 1e-30f) * exponent;
    return exp2_of(log > -126.0f ? log : -126.0f);
}

// Linear light to an sRGB code, 0..255: a polynomial in the square root, within a tenth of a step before rounding.
inline int32_t srgb_code(float linear) {
    const float above = linear > 0.0f ? linear : 0.0f;
    const float x = above < 1.0f ? above : 1.0f;
    const float s = std::sqrt(x);
    float p = -148.989026f;
    p = p * s + 573.367261f;
    p = p * s - 905.950652f;
    p = p * s + 773.317196f;
    p = p * s - 419.630939f;
    p = p * s + 393.295773f;
    p = p * s - 10.4203252f;
    const float low = x * (255.0f * 12.92f);
    return int32_t((x > 0.0031308f ? p : low) + 0.5f);
}
