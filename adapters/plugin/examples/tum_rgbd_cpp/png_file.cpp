#include "png_file.hpp"

#include <png.h>

#include <cerrno>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>

#include "vice_plugin.hpp"

namespace tum {
namespace {

// A header may claim any size: nothing larger than this is allocated for.
constexpr std::uint64_t MAX_PIXELS = 1u << 28;

// What a read needs, outside of the function that setjmp returns to: a longjmp runs no destructors.
struct Reader {
    png_structp png = nullptr;
    png_infop info = nullptr;
    std::FILE *file = nullptr;
    char message[128] = "";
    Png image;

    ~Reader() {
        png_destroy_read_struct(&png, &info, nullptr);
        if (file != nullptr) std::fclose(file);
    }
};

// longjmp rather than throw: an exception may not pass through libpng's frames, which are C.
[[noreturn]] void on_error(png_structp png, png_const_charp what) {
    auto *reader = static_cast<Reader *>(png_get_error_ptr(png));
    std::snprintf(reader->message, sizeof reader->message, "%s", what);
    longjmp(png_jmpbuf(png), 1);
}

void on_warning(png_structp, png_const_charp) {}

// Reads the header and sets up the conversions. False with a message on an error of libpng.
bool read_header(Reader &r) {
    if (setjmp(png_jmpbuf(r.png))) return false;
    png_init_io(r.png, r.file);
    png_read_info(r.png, r.info);
    png_set_expand(r.png);
    png_set_strip_alpha(r.png);
    const std::uint16_t probe = 1;
    if (*reinterpret_cast<const std::uint8_t *>(&probe) == 1) png_set_swap(r.png);
    png_set_interlace_handling(r.png);
    png_read_update_info(r.png, r.info);
    r.image.width = png_get_image_width(r.png, r.info);
    r.image.height = png_get_image_height(r.png, r.info);
    r.image.channels = png_get_channels(r.png, r.info);
    r.image.bits = png_get_bit_depth(r.png, r.info);
    return true;
}

bool read_rows(Reader &r, png_bytep *rows) {
    if (setjmp(png_jmpbuf(r.png))) return false;
    png_read_image(r.png, rows);
    png_read_end(r.png, nullptr);
    return true;
}

}  // namespace

Png read_png(const std::string &path) {
    Reader r;
    r.file = std::fopen(path.c_str(), "rb");
    if (r.file == nullptr) throw vice::Error(path + ": " + std::strerror(errno));
    r.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &r, on_error, on_warning);
    if (r.png == nullptr) throw std::bad_alloc();
    r.info = png_create_info_struct(r.png);
    if (r.info == nullptr) throw std::bad_alloc();

    if (!read_header(r)) throw vice::Error(path + ": no PNG that can be read: " + r.message);
    if (std::uint64_t{r.image.width} * r.image.height > MAX_PIXELS)
        throw vice::Error(path + ": claims " + std::to_string(r.image.width) + "x" + std::to_string(r.image.height) +
                          " pixels, more than any camera of this data set has");
    const std::size_t row_bytes = png_get_rowbytes(r.png, r.info);
    r.image.data.resize(row_bytes * r.image.height);
    std::vector<png_bytep> rows(r.image.height);
    for (std::size_t y = 0; y < rows.size(); ++y) rows[y] = r.image.data.data() + y * row_bytes;
    if (!read_rows(r, rows.data())) throw vice::Error(path + ": the PNG breaks off or is damaged: " + r.message);
    return std::move(r.image);
}

}  // namespace tum
