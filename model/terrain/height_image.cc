// load_height_image: calls libpng.
#include <fmt/format.h>
#include <png.h>

#include <cstdio>
#include <memory>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

constexpr png_uint_32 kMostPixels = limits::kMaxHeightsPerSide;

struct ClosePng {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

// libpng's structures, and its message if it failed.
struct PngReader {
  PngReader() {
    png = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, on_error, on_warning);
    if (png != nullptr) info = png_create_info_struct(png);
    if (info == nullptr) throw std::bad_alloc();
  }
  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  static void on_error(png_structp png, png_const_charp message) {
    static_cast<PngReader*>(png_get_error_ptr(png))->message = message;
    png_longjmp(png, 1);
  }
  static void on_warning(png_structp, png_const_charp) {}

  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string message;
};

// No object with a destructor may be created between setjmp and libpng's longjmp, hence two
// separate functions. They return false if libpng failed.
bool read_header(PngReader& reader, std::FILE* file) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_set_user_limits(reader.png, kMostPixels, kMostPixels);
  png_init_io(reader.png, file);
  png_read_info(reader.png, reader.info);
  return true;
}

bool read_pixels(PngReader& reader, std::vector<png_byte>& bytes, std::vector<png_bytep>& rows) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_image(reader.png, rows.data());
  png_read_end(reader.png, nullptr);
  return !bytes.empty();
}

}  // namespace

HeightGrid load_height_image(const std::filesystem::path& file) {
  std::error_code error;
  const bool regular = std::filesystem::is_regular_file(file, error);
  const std::unique_ptr<std::FILE, ClosePng> stream(regular ? std::fopen(file.c_str(), "rb")
                                                            : nullptr);
  if (!stream) throw InputError(fmt::format("{}: {}", file.string(), why_unreadable(file)));
  PngReader reader;
  const auto refuse = [&](const std::string& why) {
    throw InputError(fmt::format("{}: {}; a grayscale PNG of at most {} x {} pixels is expected",
                                 file.string(), why, kMostPixels, kMostPixels));
  };
  if (!read_header(reader, stream.get())) refuse(reader.message);
  const int depth = png_get_bit_depth(reader.png, reader.info);
  if (png_get_color_type(reader.png, reader.info) != PNG_COLOR_TYPE_GRAY) {
    refuse("the image is not plain grayscale (colour, palette or alpha)");
  }
  if (depth < 8) png_set_expand_gray_1_2_4_to_8(reader.png);
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);

  HeightGrid grid;
  grid.columns = static_cast<int>(png_get_image_width(reader.png, reader.info));
  grid.rows = static_cast<int>(png_get_image_height(reader.png, reader.info));
  if (static_cast<size_t>(grid.rows) * grid.columns > limits::kMaxHeights) {
    refuse(fmt::format("{} x {} are more than {} pixels in all", grid.rows, grid.columns,
                       limits::kMaxHeights));
  }
  const size_t row_bytes = png_get_rowbytes(reader.png, reader.info);
  std::vector<png_byte> bytes(row_bytes * grid.rows);
  std::vector<png_bytep> rows;
  for (int r = 0; r < grid.rows; ++r) rows.push_back(bytes.data() + row_bytes * r);
  if (!read_pixels(reader, bytes, rows)) refuse(reader.message);
  for (const png_byte* row : rows) {
    for (int c = 0; c < grid.columns; ++c) {
      grid.heights.push_back(depth == 16 ? (row[2 * c] * 256 + row[2 * c + 1]) / 65535.0
                                         : row[c] / 255.0);
    }
  }
  return grid;
}

}  // namespace counterpoint
