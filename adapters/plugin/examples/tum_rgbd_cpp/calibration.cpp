#include "calibration.hpp"

#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>

#include "text_file.hpp"

namespace tum {
namespace {

// The numbers of a flat JSON object, such as {"fx": 518.0, "width": 640}. Enough for camera.json, and it says so when not.
std::map<std::string, double> flat_json(const std::string &path) {
    std::ifstream file(path);
    std::stringstream whole;
    whole << file.rdbuf();
    if (!file) throw vice::Error(path + ": cannot be read");
    whole.imbue(std::locale::classic());
    const auto refuse = [&] {
        const auto at = whole.tellg();
        return vice::Error(path + ": expected one object of numbers, {\"fx\": 518.0, ...}" +
                           (at < 0 ? std::string() : ", byte " + std::to_string(at)));
    };
    const auto expect = [&](char wanted) {
        char c = 0;
        if (!(whole >> c) || c != wanted) throw refuse();
    };
    std::map<std::string, double> numbers;
    expect('{');
    for (char next = ','; next == ',';) {
        std::string key;
        double value = 0;
        expect('"');
        if (!std::getline(whole, key, '"')) throw refuse();
        expect(':');
        if (!(whole >> value) || !std::isfinite(value)) throw refuse();
        numbers[key] = value;
        if (!(whole >> next) || (next != ',' && next != '}')) throw refuse();
    }
    return numbers;
}

vice_camera with(double fx, double fy, double cx, double cy, const std::vector<double> &radtan) {
    vice_camera c{};
    c.fx_px = fx;
    c.fy_px = fy;
    c.cx_px = cx;
    c.cy_px = cy;
    c.model = radtan.empty() ? VICE_MODEL_PINHOLE : VICE_MODEL_RADTAN;
    c.coefficient_count = static_cast<std::uint32_t>(radtan.size());
    for (std::size_t i = 0; i < radtan.size(); ++i) c.coefficients[i] = radtan[i];
    return c;
}

// The values that the data set's site publishes for its RGB cameras (k1 k2 p1 p2 k3). Depth is registered to colour.
std::optional<vice_camera> published(const std::string &folder) {
    const auto has = [&](const char *word) { return folder.find(word) != std::string::npos; };
    if (has("freiburg1")) return with(517.3, 516.5, 318.6, 255.3, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633});
    if (has("freiburg2")) return with(520.9, 521.0, 325.1, 249.7, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172});
    // Its images are undistorted already.
    if (has("freiburg3")) return with(535.4, 539.2, 320.1, 247.6, {});
    return std::nullopt;
}

std::vector<double> setting_numbers(const std::string &key, const std::string &value) {
    std::vector<double> numbers;
    std::istringstream list(value);
    for (std::string word; std::getline(list, word, ',');) {
        std::istringstream stream(word);
        stream.imbue(std::locale::classic());
        double number = 0;
        if (!(stream >> number) || !(stream >> std::ws).eof() || !std::isfinite(number))
            throw vice::Error("setting " + key + ": `" + word + "` is no finite number");
        numbers.push_back(number);
    }
    return numbers;
}

}  // namespace

Calibration find_calibration(const std::string &folder, const vice::Settings &settings, std::uint32_t width,
                             std::uint32_t height) {
    Calibration found;
    const std::string path = folder + "/camera.json";
    const auto given = settings.find("camera");
    if (is_file(path)) {
        const auto json = flat_json(path);
        const auto get = [&](const char *key) {
            const auto at = json.find(key);
            if (at == json.end()) throw vice::Error(path + ": has no \"" + key + "\"");
            return at->second;
        };
        found.camera = with(get("fx"), get("fy"), get("cx"), get("cy"), {});
        if (json.count("k1") != 0) {
            found.camera = with(get("fx"), get("fy"), get("cx"), get("cy"),
                                {get("k1"), get("k2"), get("p1"), get("p2"), json.count("k3") ? get("k3") : 0.0});
        }
        if (json.count("width") != 0 && (get("width") != width || get("height") != height))
            throw vice::Error(path + ": is of " + std::to_string(static_cast<long>(get("width"))) + "x" +
                              std::to_string(static_cast<long>(get("height"))) + " pixels, the images have " +
                              std::to_string(width) + "x" + std::to_string(height));
        if (json.count("depth_units_per_m") != 0) found.depth_counts_per_m = get("depth_units_per_m");
    } else if (const auto camera = published(folder)) {
        found.camera = *camera;
    } else if (given == settings.end()) {
        throw vice::Error(folder + ": nothing says what camera this is; add camera.json with fx, fy, cx, cy, or give "
                                   "--set camera=fx,fy,cx,cy[,k1,k2,p1,p2,k3]");
    }
    if (given != settings.end()) {
        const auto n = setting_numbers("camera", given->second);
        if (n.size() != 4 && n.size() != 8 && n.size() != 9)
            throw vice::Error("setting camera: expected fx,fy,cx,cy[,k1,k2,p1,p2[,k3]], got " +
                              std::to_string(n.size()) + " numbers");
        found.camera = with(n[0], n[1], n[2], n[3], {n.begin() + 4, n.end()});
    }
    if (const auto scale = settings.find("depth-scale"); scale != settings.end()) {
        const auto n = setting_numbers("depth-scale", scale->second);
        if (n.size() != 1) throw vice::Error("setting depth-scale: expected one number");
        found.depth_counts_per_m = n[0];
    }
    if (!(found.depth_counts_per_m > 0)) throw vice::Error("setting depth-scale: expected counts a metre above 0");
    found.camera.width_px = width;
    found.camera.height_px = height;
    return found;
}

}  // namespace tum
