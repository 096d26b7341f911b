// TUM RGB-D as a plugin of VICE: rgb.txt, depth.txt and groundtruth.txt, with the PNG files that they name.
//
// The body is the colour camera: the ground truth is its pose, and body_from_camera the identity.
#include <dirent.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>

#include "calibration.hpp"
#include "png_file.hpp"
#include "text_file.hpp"
#include "vice_plugin.hpp"

namespace tum {
namespace {

// Colour and depth are not taken at one instant; the data set's own tool pairs what is at most this far apart.
constexpr std::int64_t MAX_PAIR_NS = 20'000'000;

struct Frame {
    std::int64_t stamp_ns;
    std::string path;
};

std::string last_name(std::string path) {
    while (path.size() > 1 && path.back() == '/') path.pop_back();
    const std::size_t slash = path.rfind('/');
    return slash == std::string::npos ? path : path.substr(slash + 1);
}

// rgb.txt or depth.txt: `stamp file`, stamps strictly increasing, files inside the folder.
std::vector<Frame> read_list(const std::string &folder, const std::string &name) {
    const std::string path = folder + "/" + name;
    std::vector<Frame> frames;
    for (const Row &row : read_rows(path)) {
        if (row.words.size() != 2)
            throw vice::Error(at_line(path, row, "expected `stamp file`, got " + std::to_string(row.words.size()) +
                                                     " words"));
        const std::int64_t stamp = stamp_ns(path, row, row.words[0]);
        const std::string &file = row.words[1];
        if (file.front() == '/' || file.find("..") != std::string::npos)
            throw vice::Error(at_line(path, row, "`" + file + "` leads out of the data set"));
        if (!frames.empty() && stamp <= frames.back().stamp_ns)
            throw vice::Error(at_line(path, row, "the stamp is not later than the one before; sort the file and "
                                                 "remove what is there twice"));
        frames.push_back({stamp, folder + "/" + file});
    }
    if (frames.empty()) throw vice::Error(path + ": lists no images");
    return frames;
}

std::vector<std::uint8_t> read_bytes(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) throw vice::Error(path + ": cannot be read");
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// groundtruth.txt: `stamp tx ty tz qx qy qz qw`, world from camera.
std::vector<vice_pose> read_poses(const std::string &path) {
    std::vector<vice_pose> poses;
    for (const Row &row : read_rows(path)) {
        if (row.words.size() != 8)
            throw vice::Error(at_line(path, row, "expected `stamp tx ty tz qx qy qz qw`, got " +
                                                     std::to_string(row.words.size()) + " words"));
        double n[7];
        for (std::size_t i = 0; i < 7; ++i) n[i] = number(path, row, row.words[i + 1]);
        // Six decimals in the file: near to unit length, and made exactly so here, where the row is known.
        const double length = std::sqrt(n[3] * n[3] + n[4] * n[4] + n[5] * n[5] + n[6] * n[6]);
        if (std::abs(length - 1.0) > 1e-3)
            throw vice::Error(at_line(path, row, "the quaternion's length is not 1"));
        vice_pose pose{};
        pose.stamp_ns = stamp_ns(path, row, row.words[0]);
        if (!poses.empty() && pose.stamp_ns <= poses.back().stamp_ns)
            throw vice::Error(at_line(path, row, "the stamp is not later than the one before"));
        pose.world_from_body = {{n[0], n[1], n[2]}, {n[6] / length, n[3] / length, n[4] / length, n[5] / length}};
        poses.push_back(pose);
    }
    if (poses.empty()) throw vice::Error(path + ": has no poses");
    return poses;
}

class Sequence final : public vice::Dataset {
  public:
    Sequence(const std::string &folder, const vice::Settings &settings)
        : folder_(folder), colour_(read_list(folder, "rgb.txt")) {
        if (is_file(folder + "/depth.txt")) depth_ = read_list(folder, "depth.txt");
        const Png first = read_png(colour_.front().path);
        calibration_ = find_calibration(folder, settings, first.width, first.height);
    }

    std::string name() override { return last_name(folder_); }
    std::vector<vice::CameraName> cameras() override { return {{"rgb", !depth_.empty()}}; }
    std::vector<vice::StreamName> streams() override {
        if (!is_file(folder_ + "/groundtruth.txt")) return {};
        return {{"ground-truth", VICE_STREAM_POSES}};
    }
    vice_camera camera(std::size_t) override { return calibration_.camera; }

    std::vector<std::int64_t> frames_ns(std::size_t) override {
        std::vector<std::int64_t> stamps;
        for (const Frame &f : colour_) stamps.push_back(f.stamp_ns);
        return stamps;
    }

    // As it is stored: VICE decodes it.
    std::optional<std::vector<std::uint8_t>> image_file(std::size_t, std::size_t index) override {
        return read_bytes(colour_.at(check(index)).path);
    }

    vice_rigid body_from_camera(std::size_t, std::int64_t) override { return {{0, 0, 0}, {1, 0, 0, 0}}; }
    std::vector<vice_pose> trajectory(std::size_t) override { return read_poses(folder_ + "/groundtruth.txt"); }

    std::optional<vice::DepthImage> depth_image(std::size_t, std::size_t index) override {
        const Frame *frame = nearest_depth(colour_.at(check(index)).stamp_ns);
        if (frame == nullptr) return std::nullopt;
        const Png png = read_png(frame->path);
        if (png.bits != 16 || png.channels != 1) throw vice::Error(frame->path + ": expected 16 bits, one channel");
        vice::DepthImage depth;
        depth.stamp_ns = frame->stamp_ns;
        depth.width_px = png.width;
        depth.height_px = png.height;
        depth.z_m.resize(std::size_t{png.width} * png.height);
        for (std::size_t i = 0; i < depth.z_m.size(); ++i) {
            std::uint16_t count = 0;
            std::memcpy(&count, png.data.data() + 2 * i, 2);
            depth.z_m[i] = count == 0 ? std::numeric_limits<float>::quiet_NaN()
                                      : static_cast<float>(count / calibration_.depth_counts_per_m);
        }
        return depth;
    }

    std::vector<vice::Fact> facts() override {
        return {{"files", std::to_string(colour_.size()) + " colour images, " + std::to_string(depth_.size()) +
                              " depth images"}};
    }

  private:
    std::size_t check(std::size_t index) const {
        if (index >= colour_.size())
            throw vice::Error("there is no frame " + std::to_string(index) + "; there are " +
                              std::to_string(colour_.size()));
        return index;
    }

    const Frame *nearest_depth(std::int64_t stamp_ns) const {
        const auto later = std::lower_bound(depth_.begin(), depth_.end(), stamp_ns,
                                            [](const Frame &f, std::int64_t t) { return f.stamp_ns < t; });
        const Frame *best = nullptr;
        for (auto at = later == depth_.begin() ? later : later - 1; at != depth_.end() && at <= later; ++at) {
            const std::int64_t apart = std::abs(at->stamp_ns - stamp_ns);
            if (apart <= MAX_PAIR_NS && (best == nullptr || apart < std::abs(best->stamp_ns - stamp_ns))) best = &*at;
        }
        return best;
    }

    std::string folder_;
    std::vector<Frame> colour_;
    std::vector<Frame> depth_;
    Calibration calibration_;
};

bool looks_right(const std::string &folder) {
    return is_file(folder + "/rgb.txt") && (is_file(folder + "/depth.txt") || is_file(folder + "/groundtruth.txt"));
}

class TumRgbd final : public vice::Format {
  public:
    std::string name() override { return "tum-rgbd"; }
    std::string version() override { return "0.1.0"; }
    std::string description() override { return "TUM RGB-D sequences: rgb.txt, depth.txt, groundtruth.txt"; }
    std::vector<std::string> offers() override { return {"images", "depth", "ground truth"}; }
    std::vector<vice::SettingInfo> settings() override {
        return {{"camera", "fx,fy,cx,cy[,k1,k2,p1,p2[,k3]] in pixels [default: camera.json, or what freiburg1 to 3 publish]"},
                {"depth-scale", "counts of a depth image a metre [default: camera.json, or 5000]"}};
    }
    // A sequence does not change once it is open, and each image is read by itself.
    bool thread_safe() override { return true; }

    vice::Probe probe(const std::string &path) override {
        if (looks_right(path)) return {VICE_PROBE_YES, {}};
        vice::Probe collection;
        if (DIR *folder = opendir(path.c_str())) {
            try {
                while (const dirent *entry = readdir(folder)) {
                    const std::string inside = path + "/" + entry->d_name;
                    if (entry->d_name[0] != '.' && looks_right(inside)) collection.paths.push_back(inside);
                }
            } catch (...) {
                closedir(folder);
                throw;
            }
            closedir(folder);
        }
        if (!collection.paths.empty()) {
            std::sort(collection.paths.begin(), collection.paths.end());
            collection.answer = VICE_PROBE_COLLECTION;
        }
        return collection;
    }

    std::unique_ptr<vice::Dataset> open(const std::string &path, const vice::Settings &settings) override {
        if (!looks_right(path)) throw vice::Error(path + ": no rgb.txt with a depth.txt or groundtruth.txt here");
        return std::make_unique<Sequence>(path, settings);
    }
};

}  // namespace
}  // namespace tum

VICE_PLUGIN(tum::TumRgbd)
