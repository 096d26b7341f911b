// A plugin in C++17: derive from vice::Format and vice::Dataset, and write VICE_PLUGIN(YourFormat) once, at file scope.
//
// Every call catches what is thrown and hands its text over as the error; nothing else may cross the border. Throw
// vice::Error (or anything derived from std::exception) with one line: what is wrong, with the file and line, and what to do.
// vice_plugin.h says which frames, units and orders are meant; vice_plugin_export.hpp fills its table from these classes.
#ifndef VICE_PLUGIN_HPP
#define VICE_PLUGIN_HPP

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "vice_plugin.h"

namespace vice {

// Data that cannot be used: what is wrong, what to do about it, and of which kind it is (VICE_ERROR_...).
class Error : public std::runtime_error {
  public:
    explicit Error(const std::string &problem, const std::string &hint = {}, std::int32_t code = VICE_ERROR)
        : std::runtime_error(hint.empty() ? problem : problem + " (" + hint + ")"),
          hint_length_(hint.size()),
          code_(code < VICE_ERROR ? VICE_ERROR : code) {}

    // The last bytes of what(), before the bracket.
    std::size_t hint_length() const { return hint_length_; }
    std::int32_t code() const { return code_; }

  private:
    std::size_t hint_length_;
    std::int32_t code_;
};

// A decoded image: rows tight, from the top. Without pixels VICE decodes what image_file gives.
struct Image {
    std::uint32_t width_px = 0;
    std::uint32_t height_px = 0;
    std::int32_t format = VICE_PIXELS_GRAY8;
    std::vector<std::uint8_t> pixels;
};

// A depth image: metres along the optical axis, 0 or NaN where there is none; rows tight, from the top.
struct DepthImage {
    std::int64_t stamp_ns = 0;
    std::uint32_t width_px = 0;
    std::uint32_t height_px = 0;
    std::vector<float> z_m;
};

// The scan of the scene: a PLY file where the path is not empty, else the points.
struct Cloud {
    std::string ply_path;
    std::vector<vice_point> points;
    vice_rigid world_from_cloud = {{0, 0, 0}, {1, 0, 0, 0}};
};

struct CameraName {
    std::string name;
    bool has_depth = false;
};

struct StreamName {
    std::string name;  // "ground-truth" for the truth
    std::int32_t kind = VICE_STREAM_POSES;
};

struct Fact {
    std::string section;
    std::string text;
};

// Something in the data that may make the numbers wrong, but does not stop the work.
struct Suspicion {
    std::string code;     // a stable name such as "rows-left-out": a-z, 0-9 and -
    std::string about;    // a file, a stream, a topic or a camera; empty: the whole data set
    std::string message;  // what looks wrong, in a sentence
    std::string evidence;
    std::string advice;
    std::uint64_t count = 1;  // how often the same was seen
};

// A number behind a finding.
struct Number {
    std::string name;  // a-z, 0-9, % and -
    double value = 0.0;
    std::string unit;  // empty for shares and counts
};

// What a check of the format found, for `vice check`.
struct Finding {
    std::string check;  // name of the check: a-z, 0-9 and -
    std::string about;  // a stream, a camera; empty: the whole data set
    std::int32_t state = VICE_STATE_UNKNOWN;
    std::string says;  // what was found, in a sentence
    std::vector<Number> numbers;
    std::string mend;  // what mends it, or empty
};

struct SettingInfo {
    std::string key;
    std::string description;
};

struct Probe {
    std::int32_t answer = VICE_PROBE_NO;
    std::vector<std::string> paths;  // of a collection
};

using Settings = std::map<std::string, std::string>;

// An open data set. Cameras and streams are named by their place in cameras() and streams(); indices are checked before a
// method is called, frame indices of images are not.
class Dataset {
  public:
    Dataset() = default;
    Dataset(const Dataset &) = delete;
    Dataset &operator=(const Dataset &) = delete;
    virtual ~Dataset() = default;

    // A short name for tables, such as the folder's. Asked once, as are the two lists.
    virtual std::string name() = 0;
    virtual std::vector<CameraName> cameras() = 0;
    virtual std::vector<StreamName> streams() = 0;

    virtual vice_camera camera(std::size_t camera_index) = 0;
    // Strictly increasing.
    virtual std::vector<std::int64_t> frames_ns(std::size_t camera_index) = 0;
    // One of the next two. The file is a PNG or JPEG as it is stored: VICE decodes it where there is no image, and a browser
    // shows it as it is.
    virtual Image image(std::size_t, std::size_t) { return {}; }
    virtual std::optional<std::vector<std::uint8_t>> image_file(std::size_t, std::size_t) { return std::nullopt; }
    virtual vice_rigid body_from_camera(std::size_t camera_index, std::int64_t stamp_ns) = 0;
    // Strictly increasing stamps, world_from_body. Of a stream of VICE_STREAM_POSES or VICE_STREAM_CHAINED.
    virtual std::vector<vice_pose> trajectory(std::size_t stream_index) = 0;

    // Of a stream of VICE_STREAM_RELATIVE.
    virtual std::vector<vice_motion> relative_motions(std::size_t) {
        throw Error("this plugin has no relative motions");
    }
    virtual std::vector<vice_imu_sample> imu() { return {}; }
    virtual std::optional<vice_inertial_state> inertial_state(std::int64_t) { return std::nullopt; }
    virtual std::optional<DepthImage> depth_image(std::size_t, std::size_t) { return std::nullopt; }
    virtual std::optional<Cloud> cloud() { return std::nullopt; }
    // Without one z = 0 of the world.
    virtual std::optional<vice_floor> floor(std::int64_t) { return std::nullopt; }
    virtual std::vector<Fact> facts() { return {}; }
    // What looked wrong so far, each once. Asked after the data was read.
    virtual std::vector<Suspicion> suspicions() { return {}; }
    // What the format's own checks find. Nothing large is to be read for it.
    virtual std::vector<Finding> checks() { return {}; }
};

// A format. One object is made, once, and never destroyed.
class Format {
  public:
    virtual ~Format() = default;
    virtual std::string name() = 0;
    virtual std::string version() = 0;
    virtual std::string description() = 0;
    virtual std::vector<std::string> offers() { return {"images"}; }
    virtual std::vector<SettingInfo> settings() { return {}; }
    // Whether calls may overlap, on one data set and on several.
    virtual bool thread_safe() { return false; }
    virtual Probe probe(const std::string &path) = 0;
    virtual std::unique_ptr<Dataset> open(const std::string &path, const Settings &settings) = 0;
};

// A line to the user. Safe from any thread.
inline void log(std::int32_t level, std::string_view line);
inline void warn(std::string_view line) { log(VICE_LOG_WARN, line); }

}  // namespace vice

#include "vice_plugin_export.hpp"

// Exports a format: a class that is default constructible and derived from vice::Format.
#define VICE_PLUGIN(FormatClass)                                                             \
    extern "C" VICE_EXPORT const vice_plugin_table *vice_plugin(const vice_host *host) {     \
        return ::vice::detail::Export<FormatClass>::table(host);                             \
    }

#endif
