// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace gpureg::cli {

struct Color {
  std::uint8_t r = 0, g = 0, b = 0;
};

/// 8 bits per channel, rows from the top.
struct Image {
  int width = 0, height = 0;
  std::vector<Color> pixels;

  Image() = default;
  Image(int w, int h, Color fill)
      : width(w),
        height(h),
        pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), fill) {}

  Color& at(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  const Color& at(int x, int y) const { return const_cast<Image*>(this)->at(x, y); }
};

void fill(Image& image, int x, int y, int width, int height, Color color);  ///< clipped
void paste(Image& image, const Image& part, int x, int y);                  ///< must lie inside

/// Draws text in a font of 5 x 7 dots; a dot is scale x scale pixels. Lowercase letters become
/// uppercase, characters without a glyph become boxes. Clipped to the image.
void draw_text(Image& image, int x, int y, int scale, Color color, const std::string& text);
int text_width(const std::string& text, int scale);

/// The bytes of a PNG file. Throws IoError when libpng fails.
std::string encode_png(const Image& image);

}  // namespace gpureg::cli
