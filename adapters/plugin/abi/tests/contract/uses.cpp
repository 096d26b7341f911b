// The least that a plugin is: so that all of the wrapper is compiled, with what is missing in a structure as a warning.
#include "vice_plugin.hpp"

struct Run : vice::Dataset {
    std::string name() override { return "a run"; }
    std::vector<vice::CameraName> cameras() override { return {{"cam", false}}; }
    std::vector<vice::StreamName> streams() override { return {{"ground-truth", VICE_STREAM_CHAINED}}; }
    vice_camera camera(std::size_t) override { throw vice::Error("no", "do", VICE_ERROR_MISSING); }
    std::vector<std::int64_t> frames_ns(std::size_t) override { return {}; }
    vice_rigid body_from_camera(std::size_t, std::int64_t) override { return {{0, 0, 0}, {1, 0, 0, 0}}; }
    std::vector<vice_pose> trajectory(std::size_t) override { return {}; }
};

struct Least : vice::Format {
    std::string name() override { return "least"; }
    std::string version() override { return "1"; }
    std::string description() override { return "d"; }
    vice::Probe probe(const std::string &) override { return {VICE_PROBE_NO, {}}; }
    std::unique_ptr<vice::Dataset> open(const std::string &, const vice::Settings &) override {
        return std::make_unique<Run>();
    }
};

VICE_PLUGIN(Least)
