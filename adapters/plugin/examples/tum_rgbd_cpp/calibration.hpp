// Where the intrinsics of a TUM RGB-D sequence come from: the format itself has no file for them.
#pragma once

#include <string>

#include "vice_plugin.hpp"

namespace tum {

// The camera and the depth counts a metre.
struct Calibration {
    vice_camera camera{};
    double depth_counts_per_m = 5000;
};

// From `camera.json` in the folder, else the published values of the sequences whose folder says freiburg1, 2 or 3,
// either overridden by the settings `camera` and `depth-scale`. Width and height are those of the first image.
Calibration find_calibration(const std::string &folder, const vice::Settings &settings, std::uint32_t width,
                             std::uint32_t height);

}  // namespace tum
