#include "record/drawing.h"

#include <cairo.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>

namespace topple::record {
namespace {

std::uint32_t big_endian(const std::string& bytes, size_t at) {
  std::uint32_t v = 0;
  for (size_t i = 0; i < 4; ++i) v = v << 8 | static_cast<std::uint8_t>(bytes[at + i]);
  return v;
}

struct Pixels {
  int width = 0, height = 0;
  std::vector<std::uint32_t> rgb;
  std::uint32_t at(int x, int y) const { return rgb[static_cast<size_t>(y * width + x)]; }
};

/// Reads a PNG back.
Pixels decode(const std::string& png) {
  struct Reader {
    const std::string& bytes;
    size_t at;
  } reader{png, 0};
  cairo_surface_t* surface = cairo_image_surface_create_from_png_stream(
      [](void* closure, unsigned char* data, unsigned int length) {
        auto& r = *static_cast<Reader*>(closure);
        if (r.at + length > r.bytes.size()) return CAIRO_STATUS_READ_ERROR;
        std::memcpy(data, r.bytes.data() + r.at, length);
        r.at += length;
        return CAIRO_STATUS_SUCCESS;
      },
      &reader);
  EXPECT_EQ(cairo_surface_status(surface), CAIRO_STATUS_SUCCESS);
  Pixels out;
  out.width = cairo_image_surface_get_width(surface), out.height = cairo_image_surface_get_height(surface);
  const int stride = cairo_image_surface_get_stride(surface);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      std::uint32_t v = 0;
      std::memcpy(&v, cairo_image_surface_get_data(surface) + y * stride + 4 * x, 4);
      out.rgb.push_back(v & 0xffffffU);
    }
  cairo_surface_destroy(surface);
  return out;
}

Drawing sample() {
  Drawing d;
  d.width = 100, d.height = 60;
  d.title = "A <sample>";
  d.area({{10, 10}, {50, 10}, {50, 50}, {10, 50}}, Ink::Series0);
  d.line({{60, 30}, {90, 30}}, Ink::Series1, 6);
  d.circle({75, 50}, 5, Ink::Crushed, Ink::Text);
  d.text({5, 8}, "a < b & \"c\"", Ink::Text, 9);
  return d;
}

TEST(Drawing, PngHasTheSizeAndTheColours) {
  const std::string png = to_png(sample(), 2);
  ASSERT_EQ(png.substr(0, 8), std::string("\x89PNG\r\n\x1a\n", 8));
  EXPECT_EQ(png.substr(12, 4), "IHDR");
  EXPECT_EQ(big_endian(png, 16), 200u);
  EXPECT_EQ(big_endian(png, 20), 120u);
  const Pixels p = decode(png);
  EXPECT_EQ(p.at(60, 60), 0x0072b2u) << "inside the area";
  EXPECT_EQ(p.at(150, 60), 0xd55e00u) << "on the line";
  EXPECT_EQ(p.at(150, 100), 0x8c1f3fu) << "in the circle";
  EXPECT_EQ(p.at(196, 10), 0xffffffu) << "paper";
  int dark = 0;
  for (int x = 10; x < 120; ++x)
    for (int y = 0; y < 18; ++y) dark += p.at(x, y) != 0xffffffu;
  EXPECT_GT(dark, 50) << "letters";
}

TEST(Drawing, SameShapesGiveTheSameBytes) { EXPECT_EQ(to_png(sample(), 2), to_png(sample(), 2)); }

TEST(Drawing, SvgEscapesItsTexts) {
  const std::string svg = to_svg(sample());
  EXPECT_NE(svg.find("aria-label=\"A &lt;sample&gt;\""), std::string::npos);
  EXPECT_NE(svg.find(">a &lt; b &amp; &quot;c&quot;</text>"), std::string::npos);
  EXPECT_NE(svg.find("viewBox=\"0 0 100 60\""), std::string::npos);
  EXPECT_EQ(svg.find("#"), std::string::npos) << "colours come from the page";
}

TEST(Drawing, CssHasEveryColourInLightAndDark) {
  const std::string css = drawing_css();
  for (const char* ink : {"text", "0", "5", "crushed", "compression"}) {
    const std::string variable = std::string("--ink-") + ink + ":#";
    const size_t light = css.find(variable);
    ASSERT_NE(light, std::string::npos) << ink;
    EXPECT_NE(css.find(variable, light + 1), std::string::npos) << ink;
    EXPECT_NE(css.find(std::string(".drawing .f-") + ink + "{"), std::string::npos) << ink;
  }
  EXPECT_NE(css.find("prefers-color-scheme:dark"), std::string::npos);
}

TEST(Drawing, RefusesAnImpossibleSize) {
  Drawing d = sample();
  d.width = 1e6;
  EXPECT_THROW(to_png(d, 10), std::runtime_error);
}

}  // namespace
}  // namespace topple::record
