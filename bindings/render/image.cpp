// PNG through libpng's simplified interface, written beside its place and renamed into it.
#include <png.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <vector>

#include "render.h"

namespace render {

bool Image::operator==(const Image &other) const {
  return width == other.width && height == other.height && rgb == other.rgb;
}

bool write_png(const std::string &path, const Image &picture, std::string *why_not) {
  const auto refuse = [&](const std::string &reason) {
    if (why_not) *why_not = "cannot write " + path + ": " + reason;
    return false;
  };
  if (picture.width == 0 || picture.height == 0 ||
      picture.rgb.size() != size_t(picture.width) * picture.height * 3)
    return refuse("the picture is empty");
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = picture.width;
  png.height = picture.height;
  png.format = PNG_FORMAT_RGB;
  // into memory first: libpng says of a write that fails only that it does
  png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(png);
  std::vector<unsigned char> encoded(bytes);
  const bool done =
      png_image_write_to_memory(&png, encoded.data(), &bytes, 0, picture.rgb.data(), 0, nullptr);
  const std::string message = png.message;
  png_image_free(&png);
  if (!done) return refuse(message);
  const std::string partial = path + ".part" + std::to_string(getpid());
  std::FILE *file = std::fopen(partial.c_str(), "wb");
  if (!file) return refuse(std::strerror(errno));
  int reason = std::fwrite(encoded.data(), 1, bytes, file) == bytes ? 0 : errno;
  if (std::fclose(file) != 0 && reason == 0) reason = errno;
  if (reason == 0 && std::rename(partial.c_str(), path.c_str()) == 0) return true;
  if (reason == 0) reason = errno;
  std::remove(partial.c_str());
  return refuse(std::strerror(reason));
}

bool read_png(const std::string &path, Image &picture, std::string *why_not) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&png, path.c_str())) {
    png.format = PNG_FORMAT_RGB;
    const bool bounded = png.width <= 16384 && png.height <= 16384;
    if (bounded) {
      picture.width = png.width;
      picture.height = png.height;
      picture.rgb.resize(size_t(png.width) * png.height * 3);
      const png_color white{255, 255, 255};
      if (png_image_finish_read(&png, &white, picture.rgb.data(), 0, nullptr)) return true;
    } else {
      std::snprintf(png.message, sizeof png.message, "larger than 16384 x 16384 pixels");
    }
  }
  if (why_not) *why_not = "cannot read " + path + ": " + png.message;
  png_image_free(&png);
  return false;
}

}  // namespace render
