// What happens to exceptions: with the wrapper they become errors; with RAW one leaves a call, which is undefined.
#include <stdexcept>

#include "vice_plugin.hpp"

struct Run : vice::Dataset {
    std::string name() override { return "a run"; }
    std::vector<vice::CameraName> cameras() override { return {{"cam", false}}; }
    std::vector<vice::StreamName> streams() override { return {{"ground-truth", VICE_STREAM_POSES}, {"number", VICE_STREAM_POSES}}; }
    vice_camera camera(std::size_t) override { return {8, 4, 6, 6, 3.5, 1.5, VICE_MODEL_PINHOLE, 0, {}}; }
    std::vector<std::int64_t> frames_ns(std::size_t) override { return {1000000000, 1100000000}; }
    vice::Image image(std::size_t, std::size_t) override { throw vice::Error("frames.csv:3: the film is torn"); }
    vice_rigid body_from_camera(std::size_t, std::int64_t) override { return {{0, 0, 0}, {1, 0, 0, 0}}; }
    std::vector<vice_pose> trajectory(std::size_t stream_index) override {
        if (stream_index == 1) throw 42;
        throw std::logic_error("a vector is too short");
    }
};

struct Throwing : vice::Format {
    std::string name() override { return "throwing"; }
    std::string version() override { return "1"; }
    std::string description() override { return "A plugin of the tests"; }
    vice::Probe probe(const std::string &) override { return {VICE_PROBE_YES, {}}; }
    std::unique_ptr<vice::Dataset> open(const std::string &, const vice::Settings &) override {
        return std::make_unique<Run>();
    }
};

#ifdef RAW
extern "C" std::int32_t throws(vice_text, vice_probe *, vice_message *) { throw std::runtime_error("out of here"); }

extern "C" VICE_EXPORT const vice_plugin_table *vice_plugin(const vice_host *host) {
    static vice_plugin_table table = *vice::detail::Export<Throwing>::table(host);
    table.probe = throws;
    return &table;
}
#else
VICE_PLUGIN(Throwing)
#endif
