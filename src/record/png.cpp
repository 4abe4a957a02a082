// PNG pictures; the one file that knows the cairo library.

#include <cairo.h>

#include <cmath>
#include <memory>
#include <stdexcept>

#include "record/drawing.h"
#include "record/inks.h"

namespace topple::record {

namespace {

struct Destroy {
  void operator()(cairo_surface_t* s) const { cairo_surface_destroy(s); }
  void operator()(cairo_t* c) const { cairo_destroy(c); }
};

constexpr double pi = 3.14159265358979323846;

void use(cairo_t* c, Ink ink, double opacity) {
  const std::uint32_t rgb = colours_of(ink).light;
  cairo_set_source_rgba(c, (rgb >> 16 & 255U) / 255.0, (rgb >> 8 & 255U) / 255.0, (rgb & 255U) / 255.0, opacity);
}

void paint(cairo_t* c, const Shape& s) {
  if (s.fill != Ink::None) {
    use(c, s.fill, s.opacity);
    cairo_fill_preserve(c);
  }
  if (s.stroke != Ink::None) {
    use(c, s.stroke, s.opacity);
    cairo_set_line_width(c, s.width);
    cairo_set_dash(c, s.dash.data(), static_cast<int>(s.dash.size()), 0);
    cairo_stroke_preserve(c);
  }
  cairo_new_path(c);
}

void write(cairo_t* c, const Shape& s) {
  cairo_select_font_face(c, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         s.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  // what stands for sans-serif on Debian is wider than the faces that browsers take
  cairo_set_font_size(c, 0.92 * s.size);
  cairo_text_extents_t extents;
  cairo_text_extents(c, s.text.c_str(), &extents);
  cairo_save(c);
  cairo_translate(c, s.dots.front().x, s.dots.front().y);
  cairo_rotate(c, s.turn * pi / 180);
  cairo_move_to(c, -s.anchor * extents.x_advance, 0);
  use(c, s.fill, s.opacity);
  cairo_show_text(c, s.text.c_str());
  cairo_restore(c);
  cairo_new_path(c);
}

cairo_status_t collect(void* closure, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

std::string to_png(const Drawing& d, double scale) {
  const int width = static_cast<int>(std::lround(d.width * scale)),
            height = static_cast<int>(std::lround(d.height * scale));
  const std::unique_ptr<cairo_surface_t, Destroy> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height));
  const std::unique_ptr<cairo_t, Destroy> context(cairo_create(surface.get()));
  cairo_t* c = context.get();
  const auto check = [](cairo_status_t status) {
    if (status != CAIRO_STATUS_SUCCESS)
      throw std::runtime_error(std::string("a picture cannot be drawn: ") + cairo_status_to_string(status));
  };
  check(cairo_status(c));
  use(c, Ink::Panel, 1);
  cairo_paint(c);
  cairo_scale(c, scale, scale);
  cairo_set_line_join(c, CAIRO_LINE_JOIN_ROUND);
  for (const Shape& s : d.shapes) {
    switch (s.kind) {
      case Shape::Kind::Line:
      case Shape::Kind::Area:
        for (size_t i = 0; i < s.dots.size(); ++i) {
          if (i == 0)
            cairo_move_to(c, s.dots[i].x, s.dots[i].y);
          else
            cairo_line_to(c, s.dots[i].x, s.dots[i].y);
        }
        if (s.kind == Shape::Kind::Area) cairo_close_path(c);
        paint(c, s);
        break;
      case Shape::Kind::Circle:
        cairo_arc(c, s.dots.front().x, s.dots.front().y, s.radius, 0, 2 * pi);
        paint(c, s);
        break;
      case Shape::Kind::Text:
        write(c, s);
        break;
    }
  }
  check(cairo_status(c));
  std::string bytes;
  check(cairo_surface_write_to_png_stream(surface.get(), collect, &bytes));
  return bytes;
}

}  // namespace topple::record
