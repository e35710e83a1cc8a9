// Traces a file of triangles and rays one by one with Embree and tells the times as JSON, in the manner of
// `benches/rays/main.rs`; the format is described in `benches/rays/file.rs`. `benches/rays_side_by_side.py` compiles and
// runs it. Works with Embree 3 and 4.
//
//     rays FILE [--threads N] [--passes N] [--robust] [--verbose]

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <vector>
#if defined(__SSE__)
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

namespace {

// Rays that a thread takes at a time.
constexpr size_t chunk_size = 4096;

struct RaySet {
    std::string name;
    bool any = false;
    std::vector<std::array<float, 8>> rays;
};

struct Found {
    uint64_t hits = 0;
    double sum_t = 0.0;
};

[[noreturn]] void fail(const std::string& reason) {
    std::fprintf(stderr, "error: %s\n", reason.c_str());
    std::exit(2);
}

template <typename T> void read(std::istream& in, T* to, size_t count) {
    in.read(reinterpret_cast<char*>(to), static_cast<std::streamsize>(count * sizeof(T)));
    if (!in) fail("the file ends early");
}

double seconds_of(const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Embree's advice for every thread that traces: numbers too small for normal ones count as zero.
void flush_denormals() {
#if defined(__SSE__)
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
#endif
}

Found trace(RTCScene scene, const RaySet& set, size_t begin, size_t end) {
#if RTC_VERSION_MAJOR < 4
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
#endif
    Found found;
    for (size_t i = begin; i < end; ++i) {
        const auto& r = set.rays[i];
        RTCRayHit query;
        query.ray.org_x = r[0], query.ray.org_y = r[1], query.ray.org_z = r[2];
        query.ray.dir_x = r[3], query.ray.dir_y = r[4], query.ray.dir_z = r[5];
        query.ray.tnear = r[6], query.ray.tfar = r[7];
        query.ray.time = 0.0f;
        query.ray.mask = 0xFFFFFFFFu, query.ray.id = 0, query.ray.flags = 0;
        if (set.any) {
#if RTC_VERSION_MAJOR < 4
            rtcOccluded1(scene, &context, &query.ray);
#else
            rtcOccluded1(scene, &query.ray);
#endif
            found.hits += query.ray.tfar < 0.0f;
        } else {
            query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR < 4
            rtcIntersect1(scene, &context, &query);
#else
            rtcIntersect1(scene, &query);
#endif
            if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
                found.hits += 1;
                found.sum_t += static_cast<double>(query.ray.tfar);
            }
        }
    }
    return found;
}

Found trace_all(RTCScene scene, const RaySet& set, unsigned threads) {
    if (threads == 1) return trace(scene, set, 0, set.rays.size());
    std::vector<Found> parts((set.rays.size() + chunk_size - 1) / chunk_size);
    std::atomic<size_t> next{0};
    std::vector<std::thread> pool;
    for (unsigned t = 0; t < threads; ++t)
        pool.emplace_back([&] {
            flush_denormals();
            for (size_t part; (part = next.fetch_add(1)) < parts.size();)
                parts[part] = trace(scene, set, part * chunk_size, std::min((part + 1) * chunk_size, set.rays.size()));
        });
    for (auto& thread : pool) thread.join();
    Found all;
    for (const auto& part : parts) all.hits += part.hits, all.sum_t += part.sum_t;
    return all;
}

}  // namespace

int main(int count, char** words) {
    std::string file;
    unsigned threads = 1, passes = 3;
    bool robust = false, verbose = false;
    for (int i = 1; i < count; ++i) {
        const std::string word = words[i];
        if (word == "--threads" && i + 1 < count) threads = std::max(1, std::atoi(words[++i]));
        else if (word == "--passes" && i + 1 < count) passes = std::max(1, std::atoi(words[++i]));
        else if (word == "--robust") robust = true;
        else if (word == "--verbose") verbose = true;
        else file = word;
    }
    std::ifstream in(file, std::ios::binary);
    if (!in) fail("cannot read \"" + file + "\"");
    char magic[8];
    uint32_t sizes[3];
    read(in, magic, 8);
    if (std::memcmp(magic, "LUCRAYS1", 8) != 0) fail("not a file of rays");
    read(in, sizes, 3);
    // Embree reads 16 bytes at the last vertex.
    std::vector<float> positions(3 * size_t(sizes[0]) + 1);
    std::vector<uint32_t> corners(3 * size_t(sizes[1]));
    read(in, positions.data(), positions.size() - 1);
    read(in, corners.data(), corners.size());
    std::vector<RaySet> sets(sizes[2]);
    for (auto& set : sets) {
        char name[17] = {};
        uint32_t head[2];
        read(in, name, 16);
        read(in, head, 2);
        set.name = name;
        set.any = head[0] != 0;
        set.rays.resize(head[1]);
        read(in, set.rays.data(), set.rays.size());
    }

    flush_denormals();
    const std::string config = "threads=" + std::to_string(threads) + (verbose ? ",verbose=2" : "");
    RTCDevice device = rtcNewDevice(config.c_str());
    if (!device) fail("no Embree device");
    RTCScene scene = rtcNewScene(device);
    if (robust) rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    const double build_seconds = seconds_of([&] {
        RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions.data(), 0, 12, sizes[0]);
        rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, corners.data(), 0, 12, sizes[1]);
        rtcCommitGeometry(mesh);
        rtcAttachGeometry(scene, mesh);
        rtcReleaseGeometry(mesh);
        rtcCommitScene(scene);
    });
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE) fail("Embree could not build the scene");

    std::printf("{\"tracer\": \"embree %s%s\", \"triangles\": %u, \"build_seconds\": %.9g, \"sets\": [", RTC_VERSION_STRING,
                robust ? " robust" : "", sizes[1], build_seconds);
    for (const auto& set : sets) {
        double fewest = std::numeric_limits<double>::infinity();
        Found found;
        for (unsigned pass = 0; pass < passes; ++pass)
            fewest = std::min(fewest, seconds_of([&] { found = trace_all(scene, set, threads); }));
        std::printf("%s{\"name\": \"%s\", \"rays\": %zu, \"seconds\": %.9g, \"hits\": %llu, \"sum_t\": %.17g}",
                    &set == &sets.front() ? "" : ", ", set.name.c_str(), set.rays.size(), fewest,
                    static_cast<unsigned long long>(found.hits), found.sum_t);
    }
    std::printf("]}\n");
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
}
