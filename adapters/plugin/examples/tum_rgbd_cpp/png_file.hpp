// PNG images through libpng.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace tum {

struct Png {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::uint32_t channels = 0;     // 1 gray, 3 red, green, blue
    std::uint32_t bits = 0;         // 8, or 16 in the machine's byte order
    std::vector<std::uint8_t> data;  // rows tight, from the top
};

// Reads an image. Palettes become colours, fewer than 8 bits become 8, an alpha channel is dropped; 16 bits stay 16.
Png read_png(const std::string &path);

}  // namespace tum
