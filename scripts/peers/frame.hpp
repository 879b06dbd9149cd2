// A frame: tiles of 4x4 pixels, rows of tiles handed out to threads by a counter.
#pragma once

#include <immintrin.h>

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

#include "packet.hpp"

constexpr int TILE = 4;

struct RayCount {
    long primary = 0, shadow = 0;
};

class FrameTracer {
  public:
    FrameTracer(const SceneText& text, const EmbreeScene& scene, int threads)
        : text_(text), scene_(scene), threads_(threads), grid_(text.samples == 4 ? 2 : 1) {
        if (text.samples != 1 && text.samples != 4) throw std::runtime_error("samples: 1 or 4 are expected");
        if (text.width % TILE || text.height % TILE)
            throw std::runtime_error("size: width and height have to be multiples of 4");
        const Vec3d forward = normalize(text.look_at - text.position);
        const Vec3d right = normalize(cross(forward, text.up));
        const Vec3d up = cross(right, forward);
        const double half_height = std::tan(text.fov * M_PI / 360.0);
        const double half_width = half_height * text.width / text.height;
        corner_ = forward - right * half_width + up * half_height;
        right_ = right * (2.0 * half_width / (text.width * grid_));
        down_ = up * (-2.0 * half_height / (text.height * grid_));
        for (int lane = 0; lane < LANES; ++lane) {
            const Vec3d step = right_ * (column(lane) + 0.5) + down_ * (row(lane) + 0.5);
            steps_.x[lane] = float(step.x), steps_.y[lane] = float(step.y), steps_.z[lane] = float(step.z);
        }
        pixels.resize(size_t(text.width) * text.height * 3);
    }

    RayCount trace() {
        std::atomic<int> next{0};
        std::atomic<long> shadow{0};
        auto work = [&] {
            _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
            _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
            PacketTracer packets(text_, scene_);
            long count = 0;
            for (int y; (y = next.fetch_add(TILE)) < text_.height;)
                for (int x = 0; x < text_.width; x += TILE) count += tile(packets, x, y);
            shadow += count;
        };
        std::vector<std::thread> others;
        for (int i = 1; i < threads_; ++i) others.emplace_back(work);
        work();
        for (std::thread& other : others) other.join();
        return {long(text_.width) * text_.height * text_.samples, shadow};
    }

    // RGB8, top row first.
    std::vector<uint8_t> pixels;

  private:
    // Places of a packet's rays in samples. One sample: a tile's pixels, row by row. Four: 2x2 pixels, where lane 4 s + q is
    // sample s of pixel q, so that a pixel's samples add up lane by lane.
    int column(int lane) const { return grid_ == 1 ? lane % 4 : lane % 2 * 2 + lane / 4 % 2; }
    int row(int lane) const { return grid_ == 1 ? lane / 4 : lane / 2 % 2 * 2 + lane / 8; }

    Directions directions(int column, int row) const {
        const Vec3f start = to_float(corner_ + right_ * double(column) + down_ * double(row));
        Directions out;
        for (int i = 0; i < LANES; ++i) {
            out.x[i] = start.x + steps_.x[i];
            out.y[i] = start.y + steps_.y[i];
            out.z[i] = start.z + steps_.z[i];
        }
        return out;
    }

    long tile(PacketTracer& packets, int x, int y) {
        Colors colors{};
        if (grid_ == 1) {
            const int count = packets.trace(directions(x, y), colors);
            store(colors, x, y);
            return count;
        }
        long count = 0;
        for (int quarter = 0; quarter < 4; ++quarter) {
            Colors samples{};
            const int column = 2 * x + quarter % 2 * 4, row = 2 * y + quarter / 2 * 4;
            count += packets.trace(directions(column, row), samples);
            for (int pixel = 0; pixel < 4; ++pixel) {
                // Quarter by quarter to row by row.
                const int lane = (quarter / 2 * 2 + pixel / 2) * 4 + quarter % 2 * 2 + pixel % 2;
                auto mean = [&](const Lanes& s) { return 0.25f * (s[pixel] + s[pixel + 4] + s[pixel + 8] + s[pixel + 12]); };
                colors.r[lane] = mean(samples.r), colors.g[lane] = mean(samples.g), colors.b[lane] = mean(samples.b);
            }
        }
        store(colors, x, y);
        return count;
    }

    void store(const Colors& colors, int x, int y) {
        alignas(64) uint32_t rgb[LANES];
        for (int i = 0; i < LANES; ++i)
            rgb[i] = uint32_t(srgb_code(colors.r[i]) | srgb_code(colors.g[i]) << 8 | srgb_code(colors.b[i]) << 16);
        for (int row = 0; row < TILE; ++row) {
            const uint32_t* four = rgb + row * TILE;
            const uint32_t words[3] = {four[0] | four[1] << 24, four[1] >> 8 | four[2] << 16, four[2] >> 16 | four[3] << 8};
            std::memcpy(&pixels[(size_t(y + row) * text_.width + x) * 3], words, sizeof words);
        }
    }

    const SceneText& text_;
    const EmbreeScene& scene_;
    const int threads_, grid_;
    Vec3d corner_, right_, down_;
    Directions steps_;
};
