// SPDX-License-Identifier: BSD-3-Clause
#include "pictures/image.hpp"

#include <png.h>

#include <algorithm>

#include "gpureg/error.hpp"

namespace gpureg::cli {

void fill(Image& image, int x, int y, int width, int height, Color color) {
  for (int row = std::max(y, 0); row < std::min(y + height, image.height); ++row)
    for (int column = std::max(x, 0); column < std::min(x + width, image.width); ++column)
      image.at(column, row) = color;
}

void paste(Image& image, const Image& part, int x, int y) {
  for (int row = 0; row < part.height; ++row)
    std::copy_n(&part.at(0, row), part.width, &image.at(x, y + row));
}

std::string encode_png(const Image& image) {
  static_assert(sizeof(Color) == 3, "rows are handed to libpng as they are");
  png_image description{};
  description.version = PNG_IMAGE_VERSION;
  description.width = static_cast<png_uint_32>(image.width);
  description.height = static_cast<png_uint_32>(image.height);
  description.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(description);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&description, bytes.data(), &size, 0, image.pixels.data(), 0,
                                nullptr) == 0)
    throw IoError(std::string("cannot encode a picture: ") + description.message);
  bytes.resize(size);
  return bytes;
}

}  // namespace gpureg::cli
