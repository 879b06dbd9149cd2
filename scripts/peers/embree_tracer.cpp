// A small optimised ray tracer on Embree that renders the frames of `rayfarm-master bench`. scripts/bench_peers.sh builds and
// runs it. It prints one line of JSON with the fields of `rayfarm-master bench --json`.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

#include "bounced_rays.hpp"
#include "frame.hpp"
#include "single_rays.hpp"

struct Arguments {
    std::string scene, picture, ray_file, hit_file;
    EmbreeOptions embree;
    int threads = 1, frames = 20;
    size_t rays = 0;
    uint64_t seed = 1;
};

static const char USAGE[] =
    "usage: embree_tracer SCENE.txt [--threads N] [--frames N] [--out FILE.ppm] [--quality medium|high]\n"
    "                     [--device EMBREE_CONFIG] [--rays N --seed S] [--ray-file FILE [--hits FILE]]\n"
    "       embree_tracer --version\n";

static Arguments read_arguments(int argc, char** argv) {
    Arguments arguments;
    auto wrong = [] {
        std::fputs(USAGE, stderr);
        std::exit(2);
    };
    for (int i = 1; i < argc; ++i) {
        const std::string name = argv[i];
        if (name == "--version") {
            std::puts(RTC_VERSION_STRING);
            std::exit(0);
        }
        if (name[0] != '-') {
            arguments.scene = name;
            continue;
        }
        if (++i == argc) wrong();
        const std::string value = argv[i];
        if (name == "--threads") arguments.threads = std::max(1, std::atoi(value.c_str()));
        else if (name == "--frames") arguments.frames = std::max(1, std::atoi(value.c_str()));
        else if (name == "--out") arguments.picture = value;
        else if (name == "--device") arguments.embree.device = value;
        else if (name == "--rays") arguments.rays = std::strtoull(value.c_str(), nullptr, 10);
        else if (name == "--ray-file") arguments.ray_file = value;
        else if (name == "--hits") arguments.hit_file = value;
        else if (name == "--seed") arguments.seed = std::strtoull(value.c_str(), nullptr, 10);
        else if (name == "--quality" && value == "medium") arguments.embree.quality = RTC_BUILD_QUALITY_MEDIUM;
        else if (name == "--quality" && value == "high") arguments.embree.quality = RTC_BUILD_QUALITY_HIGH;
        else wrong();
    }
    if (arguments.scene.empty()) wrong();
    return arguments;
}

static void write_ppm(const std::string& path, const SceneText& text, const std::vector<uint8_t>& pixels) {
    std::FILE* file = std::fopen(path.c_str(), "wb");
    if (!file) throw std::runtime_error(path + ": cannot be written");
    std::fprintf(file, "P6\n%d %d\n255\n", text.width, text.height);
    const bool whole = std::fwrite(pixels.data(), 1, pixels.size(), file) == pixels.size();
    if (std::fclose(file) != 0 || !whole) throw std::runtime_error(path + ": not written to its end");
}

static void single_rays(const Arguments& arguments, const EmbreeScene& scene) {
    const std::vector<SingleRay> rays = random_rays(scene, arguments.rays, arguments.seed);
    const SingleRayReport report = trace_single_rays(scene, rays, 5);
    std::printf("{\"rays\":%zu,\"hits\":%zu,\"mean_t\":%.9g,\"ns_per_ray\":%.3f,\"ns_per_ray_any_hit\":%.3f}\n",
                arguments.rays, report.hits, report.mean_t, report.ns_per_ray, report.ns_per_ray_any_hit);
}

static void frames(const Arguments& arguments, const SceneText& text, const EmbreeScene& scene) {
    using clock = std::chrono::steady_clock;
    FrameTracer tracer(text, scene, arguments.threads);
    RayCount rays = tracer.trace();  // warms caches and page tables
    std::vector<double> ms;
    for (int frame = 0; frame < arguments.frames; ++frame) {
        const auto started = clock::now();
        rays = tracer.trace();
        ms.push_back(std::chrono::duration<double, std::milli>(clock::now() - started).count());
    }
    std::sort(ms.begin(), ms.end());
    if (!arguments.picture.empty()) write_ppm(arguments.picture, text, tracer.pixels);
    std::printf(
        "{\"frames\":%d,\"width\":%d,\"height\":%d,\"samples\":%d,\"threads\":%d,"
        "\"rays_per_frame\":{\"primary\":%ld,\"shadow\":%ld},\"ms_per_frame\":{\"min\":%.3f,\"median\":%.3f,\"max\":%.3f}}\n",
        arguments.frames, text.width, text.height, text.samples, arguments.threads, rays.primary, rays.shadow,
        ms.front(), ms[(ms.size() - 1) / 2], ms.back());
}

int main(int argc, char** argv) {
    try {
        Arguments arguments = read_arguments(argc, argv);
        const SceneText text = read_scene_text(arguments.scene);
        arguments.embree.with_triangles = arguments.rays == 0;
        const EmbreeScene scene(text, arguments.embree);
        if (!arguments.ray_file.empty()) time_bounced_rays(scene, arguments.ray_file, arguments.hit_file);
        else if (arguments.rays > 0) single_rays(arguments, scene);
        else frames(arguments, text, scene);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "embree_tracer: %s\n", error.what());
        return 1;
    }
    return 0;
}
