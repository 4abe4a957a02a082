#include "record/told.h"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <utility>

#include "base/unit.h"

namespace topple::record {

std::string drop_negative_zeros(const std::string& text) {
  const auto at = [&text](size_t i) { return i < text.size() ? text[i] : ' '; };
  const auto is_part = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  std::string out;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '-' && at(i + 1) == '0' && (i == 0 || !(is_part(text[i - 1]) || text[i - 1] == ')'))) {
      size_t end = i + 1;
      bool has_point = false;
      while (at(end) == '0' || (at(end) == '.' && !has_point && at(end + 1) == '0')) has_point |= at(end++) == '.';
      // "-0.05", "-0x" and "-0-1" go on
      const bool goes_on = is_part(at(end)) || at(end) == '-' || (at(end) == '.' && is_part(at(end + 1)));
      if (!goes_on) continue;
    }
    out += text[i];
  }
  return out;
}

std::string tell_measure(double value, const char* unit, int digits) {
  // from the first value on of which two digits show
  const double least = 1e6 * std::pow(10.0, 1 - digits);
  if (!(std::abs(value) < least) || value == 0) return fmt::format("{:.{}f} M{}", value * 1e-6, digits, unit);
  if (std::abs(value) >= 100) return fmt::format("{:.1f} k{}", value * 1e-3, unit);
  return fmt::format("{:.2g} {}", value, unit);
}

std::string tell_azimuth(double azimuth, int digits) {
  const auto tell = [digits](double degrees) { return fmt::format("{:.{}f} deg", degrees, digits); };
  double degrees = std::fmod(azimuth / unit::deg, 360.0);
  // what is written as -0 is 0, and what is written as 360 too
  if (degrees < 0 && tell(degrees) != tell(-0.0)) degrees += 360;
  return tell(degrees) == tell(-0.0) || tell(degrees) == tell(360) ? tell(0) : tell(degrees);
}

int count_digits_of_angle(double angle) {
  constexpr int most = 6;
  int digits = 0;
  const double degrees = angle / unit::deg;
  for (double scale = 1; digits < most && std::abs(std::round(degrees * scale) / scale - degrees) > 1e-9; scale *= 10)
    ++digits;
  return digits;
}

void add_finding(Record& r, Finding finding) {
  finding.text = drop_negative_zeros(finding.text);
  r.findings.push_back(std::move(finding));
}

void add_event(Record& r, Event event) {
  event.text = drop_negative_zeros(event.text);
  r.events.push_back(std::move(event));
}

}  // namespace topple::record
