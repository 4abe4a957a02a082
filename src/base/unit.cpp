#include "base/unit.h"

#include <charconv>
#include <cmath>
#include <system_error>

namespace topple {

namespace {

struct Unit {
  Dimension dimension;
  std::string_view name;
  double factor;  // one unit in SI
};

constexpr Unit units[] = {
    {Dimension::Number, "%", 0.01},
    {Dimension::Length, "mm", unit::mm},
    {Dimension::Length, "cm", unit::cm},
    {Dimension::Length, "m", unit::m},
    {Dimension::Length, "km", unit::km},
    {Dimension::Area, "mm2", unit::mm2},
    {Dimension::Area, "cm2", unit::cm2},
    {Dimension::Area, "m2", unit::m2},
    {Dimension::AreaPerLength, "mm2/m", unit::mm2},
    {Dimension::AreaPerLength, "cm2/m", unit::cm2},
    {Dimension::AreaPerLength, "m2/m", unit::m2},
    {Dimension::Time, "ms", unit::ms},
    {Dimension::Time, "s", unit::s},
    {Dimension::Time, "min", 60},
    {Dimension::Mass, "kg", unit::kg},
    {Dimension::Mass, "t", unit::t},
    {Dimension::Force, "N", unit::N},
    {Dimension::Force, "kN", unit::kN},
    {Dimension::Force, "MN", unit::MN},
    {Dimension::AreaLoad, "kN/m2", unit::kPa},
    {Dimension::AreaLoad, "N/m2", unit::Pa},
    {Dimension::AreaLoad, "N/mm2", unit::MPa},
    {Dimension::AreaLoad, "MN/m2", unit::MPa},
    {Dimension::AreaLoad, "Pa", unit::Pa},
    {Dimension::AreaLoad, "kPa", unit::kPa},
    {Dimension::Stress, "N/mm2", unit::MPa},
    {Dimension::Stress, "kN/cm2", 10 * unit::MPa},
    {Dimension::Stress, "N/m2", unit::Pa},
    {Dimension::Stress, "kN/m2", unit::kPa},
    {Dimension::Stress, "MN/m2", unit::MPa},
    {Dimension::Stress, "Pa", unit::Pa},
    {Dimension::Stress, "kPa", unit::kPa},
    {Dimension::Stress, "MPa", unit::MPa},
    {Dimension::Stress, "GPa", unit::GPa},
    {Dimension::Density, "kg/m3", 1},
    {Dimension::Density, "t/m3", 1e3},
    {Dimension::Energy, "J", 1},
    {Dimension::Energy, "kJ", 1e3},
    {Dimension::Energy, "MJ", 1e6},
    {Dimension::EnergyPerArea, "J/m2", 1},
    {Dimension::EnergyPerArea, "kJ/m2", 1e3},
    {Dimension::EnergyPerArea, "N/m", 1},
    {Dimension::EnergyPerArea, "N/mm", 1e3},
    {Dimension::Velocity, "mm/s", unit::mm},
    {Dimension::Velocity, "m/s", 1},
    {Dimension::Acceleration, "m/s2", 1},
    {Dimension::Angle, "deg", unit::deg},
    {Dimension::Angle, "rad", 1},
    {Dimension::Frequency, "Hz", 1},
    {Dimension::Frequency, "1/s", 1},
    {Dimension::StiffnessPerLength, "N/m", 1},
    {Dimension::StiffnessPerLength, "N/mm", 1e3},
    {Dimension::StiffnessPerLength, "kN/m", 1e3},
    {Dimension::StiffnessPerLength, "kN/mm", 1e6},
    {Dimension::StiffnessPerLength, "MN/m", 1e6},
    {Dimension::Moment, "Nm", 1},
    {Dimension::Moment, "kNm", unit::kNm},
    {Dimension::Moment, "MNm", unit::MNm},
};

bool is_blank(char c) { return c == ' ' || c == '\t'; }

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Superscripts, "^2", a middle dot and the degree sign in the plain spelling of the table.
std::string plain_spelling(std::string_view name) {
  std::string out;
  for (size_t i = 0; i < name.size(); ++i) {
    const std::string_view rest = name.substr(i);
    if (rest.starts_with("\u00B2")) {
      out += '2', ++i;
    } else if (rest.starts_with("\u00B3")) {
      out += '3', ++i;
    } else if (rest.starts_with("\u00B7")) {
      ++i;
    } else if (rest.starts_with("\u00B0")) {
      out += "deg", ++i;
    } else if (name[i] != '^') {
      out += name[i];
    }
  }
  return out;
}

std::string quoted(std::string_view text) {
  constexpr size_t longest = 40;
  if (text.size() <= longest) return '"' + std::string(text) + '"';
  size_t end = longest;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return '"' + std::string(text.substr(0, end)) + "...\"";
}

std::string article(const std::string& noun) {
  return (std::string_view("aeiou").find(noun[0]) != std::string_view::npos ? "an " : "a ") + noun;
}

Quantity problem(std::string words) { return {std::nullopt, std::move(words)}; }

/// The same letters, capital or not.
bool is_alike(std::string_view a, std::string_view b) {
  const auto small = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](char x, char y) { return small(x) == small(y); });
}

}  // namespace

Quantity parse_quantity(std::string_view text, Dimension wanted) {
  const std::string_view all = trim(text);
  if (all.empty()) return problem("is empty; " + article(name_of(wanted)) + " is wanted");

  // std::from_chars does not look at the locale and knows no leading plus
  std::string_view rest = all;
  if (rest.size() > 1 && rest[0] == '+' && rest[1] != '-' && rest[1] != '+') rest.remove_prefix(1);
  double number = 0;
  const auto [end, failure] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
  if (failure == std::errc::invalid_argument) return problem(quoted(all) + " does not begin with a number");
  if (failure == std::errc::result_out_of_range) return problem(quoted(all) + " is beyond what a number can hold");
  if (!std::isfinite(number)) return problem(quoted(all) + " is not a finite number");
  rest.remove_prefix(static_cast<size_t>(end - rest.data()));
  if (!rest.empty() && rest[0] == ',') return problem(quoted(all) + " has a comma; decimals are written with a point");

  const std::string name = plain_spelling(trim(rest));
  double factor = 1;
  if (name.empty()) {
    if (wanted != Dimension::Number)
      return problem(quoted(all) + " has no unit; " + article(name_of(wanted)) + " is wanted");
  } else {
    const Unit* found = nullptr;
    const Unit* other = nullptr;
    for (const Unit& u : units) {
      if (u.name != name) continue;
      (u.dimension == wanted ? found : other) = &u;
    }
    if (!found && other)
      return problem(quoted(all) + " is " + article(name_of(other->dimension)) + "; " + article(name_of(wanted)) +
                     " is wanted");
    if (!found) {
      std::string words = "unknown unit " + quoted(trim(rest)) + " in " + quoted(all);
      for (const Unit& u : units)
        if (u.dimension == wanted && is_alike(u.name, name))
          return problem(words + "; did you mean " + quoted(u.name) + "?");
      return problem(std::move(words));
    }
    factor = found->factor;
  }
  const double value = number * factor;
  constexpr double largest = 1e15;
  if (std::abs(number) > largest || std::abs(value) > largest) return problem(quoted(all) + " is beyond 1e15");
  return {value, {}};
}

std::string name_of(Dimension dimension) {
  switch (dimension) {
    case Dimension::Number:
      return "number";
    case Dimension::Length:
      return "length";
    case Dimension::Area:
      return "area";
    case Dimension::AreaPerLength:
      return "area per length";
    case Dimension::Time:
      return "time";
    case Dimension::Mass:
      return "mass";
    case Dimension::Force:
      return "force";
    case Dimension::AreaLoad:
      return "area load";
    case Dimension::Stress:
      return "stress";
    case Dimension::Density:
      return "density";
    case Dimension::Energy:
      return "energy";
    case Dimension::EnergyPerArea:
      return "energy per area";
    case Dimension::Velocity:
      return "velocity";
    case Dimension::Acceleration:
      return "acceleration";
    case Dimension::Angle:
      return "angle";
    case Dimension::Frequency:
      return "frequency";
    case Dimension::StiffnessPerLength:
      return "stiffness";
    case Dimension::Moment:
      return "moment";
  }
  return "number";
}

std::string units_of(Dimension dimension) {
  std::string list;
  for (const Unit& u : units) {
    if (u.dimension != dimension) continue;
    if (!list.empty()) list += ", ";
    list += u.name;
  }
  return list;
}

}  // namespace topple
