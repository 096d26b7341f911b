// Times OpenCV from C++, one JSON line a case: what a user would call instead, in one thread.
//
// usage: peer POINTS BEFORE.raw AFTER.raw (two pictures of 752x480 bytes)
// build: c++ -O3 -march=native opencv.cpp -lopencv_calib3d -lopencv_video -lopencv_imgproc -lopencv_core
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <random>
#include <vector>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

static double best_seconds(int runs, const std::function<void()>& work) {
    work();
    double best = 1e300;
    for (int i = 0; i < runs; i++) {
        const auto start = std::chrono::steady_clock::now();
        work();
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
        best = std::min(best, took.count());
    }
    return best;
}

static void emit(const char* name, std::size_t n, double seconds) {
    std::printf("{\"name\": \"%s\", \"n\": %zu, \"seconds\": %.9g}\n", name, n, seconds);
}

static cv::Mat picture(const char* path) {
    cv::Mat image(480, 752, CV_8U);
    std::FILE* file = std::fopen(path, "rb");
    if (!file || std::fread(image.data, 1, image.total(), file) != image.total()) {
        std::fprintf(stderr, "%s cannot be read\n", path);
        std::exit(1);
    }
    std::fclose(file);
    return image;
}

int main(int count, char** arguments) {
    const std::size_t n = count > 1 ? std::strtoull(arguments[1], nullptr, 10) : 1000000;
    cv::setNumThreads(1);
    std::mt19937_64 generator(7);
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(generator);
    };
    const cv::Matx33d k(458.654, 0, 367.215, 0, 457.296, 248.375, 0, 0, 1);
    const cv::Mat d = (cv::Mat_<double>(1, 4) << -0.28340811, 0.07395907, 0.00019359, 1.76187114e-05);
    const cv::Vec3d rotation(0.1, -0.2, 0.05), translation(0.1, 0.0, -0.1), none(0, 0, 0);
    std::vector<cv::Point3d> points(n);
    std::vector<cv::Point2d> pixels(n), out;
    std::vector<double> depths(n);
    for (auto& p : points) p = {between(-0.7, 0.7), between(-0.42, 0.42), between(1, 8)};
    for (auto& p : pixels) p = {between(20, 730), between(20, 460)};
    for (auto& z : depths) z = between(1, 8);

    emit("project", n, best_seconds(3, [&] { cv::projectPoints(points, none, none, k, d, out); }));
    emit("project moved", n, best_seconds(3, [&] { cv::projectPoints(points, rotation, translation, k, d, out); }));
    // OpenCV's tolerance is in pixels: the same as 1e-10 in normalised coordinates.
    const auto converged = cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-10 * k(0, 0));
    const auto undistort = [&] {
        cv::undistortPoints(pixels, out, k, d, cv::noArray(), cv::noArray(), converged);
    };
    emit("unproject", n, best_seconds(2, undistort));
    emit("track", n, best_seconds(2, [&] {
        undistort();
        std::vector<cv::Point3d> lifted(n);
        for (std::size_t i = 0; i < n; i++) lifted[i] = {out[i].x * depths[i], out[i].y * depths[i], depths[i]};
        cv::projectPoints(lifted, rotation, translation, k, d, out);
    }));

    // A textured picture and itself a little further: 500 corners, 21x21 windows, three levels above the picture.
    if (count < 4) return 0;
    const cv::Mat before = picture(arguments[2]), after = picture(arguments[3]);
    std::vector<cv::Point2f> corners, found;
    cv::goodFeaturesToTrack(before, corners, 500, 0.01, 8);
    std::vector<unsigned char> status;
    std::vector<float> error;
    emit("pyrlk", corners.size(), best_seconds(10, [&] {
        cv::calcOpticalFlowPyrLK(before, after, corners, found, status, error, cv::Size(21, 21), 3);
    }));
}
