#include "product/plan.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace topple::product {

namespace {

constexpr double pi = 3.14159265358979323846;

auto key_of(const Member& m) { return std::make_tuple(m.kind, m.storey, m.row_a, m.frame_a, m.row_b, m.frame_b); }

/// A member that stands. read_plan sorts the members, so that a neighbour is found by halving.
const Member* find_at(const Plan& plan, MemberKind kind, int storey, int row_a, int frame_a, int row_b, int frame_b) {
  Member wanted;
  wanted.kind = kind, wanted.storey = storey;
  wanted.row_a = row_a, wanted.frame_a = frame_a, wanted.row_b = row_b, wanted.frame_b = frame_b;
  const auto it = std::lower_bound(plan.members.begin(), plan.members.end(), wanted,
                                   [](const Member& a, const Member& b) { return key_of(a) < key_of(b); });
  return it != plan.members.end() && key_of(*it) == key_of(wanted) && !it->removed ? &*it : nullptr;
}

const Section& section_of(const Plan& plan, const Member& m) { return plan.sections[static_cast<size_t>(m.section)]; }
const Panel& panel_of(const Plan& plan, const Member& m) { return plan.panels[static_cast<size_t>(m.panel)]; }

/// Half the extent of the column at a grid point, along x or along y; 0 without a column [m].
double calc_half_column(const Plan& plan, int storey, int row, int frame, bool along_x) {
  const Member* column = find_at(plan, MemberKind::Column, storey, row, frame, row, frame);
  if (!column) return 0;
  const Section& s = section_of(plan, *column);
  return (along_x ? s.width : s.height) / 2;
}

/// Length of a beam or wall between the faces of the columns at its ends [m].
double calc_clear_length(const Plan& plan, const Member& m) {
  const bool along_x = m.row_a != m.row_b;
  return norm(m.end - m.start) - calc_half_column(plan, m.storey, m.row_a, m.frame_a, along_x) -
         calc_half_column(plan, m.storey, m.row_b, m.frame_b, along_x);
}

/// Thickness of the slab on one side of a beam; 0 without a slab [m].
double calc_slab_beside(const Plan& plan, const Member& beam, bool is_lower_side) {
  const bool along_x = beam.row_a != beam.row_b;
  const int row = along_x ? beam.row_a : beam.row_a - is_lower_side;
  const int frame = along_x ? beam.frame_a - is_lower_side : beam.frame_a;
  const Member* slab = find_at(plan, MemberKind::Slab, beam.storey, row, frame, row + 1, frame + 1);
  return slab ? panel_of(plan, *slab).thickness : 0;
}

}  // namespace

const char* name_of(MemberKind kind) {
  switch (kind) {
    case MemberKind::Column:
      return "column";
    case MemberKind::Beam:
      return "beam";
    case MemberKind::Slab:
      return "slab";
    case MemberKind::Wall:
      return "wall";
    case MemberKind::Shaft:
      return "shaft";
  }
  return "";
}

int Plan::find_member(const std::string& name) const {
  const auto it = std::find_if(members.begin(), members.end(), [&](const Member& m) { return m.name == name; });
  return it == members.end() ? -1 : static_cast<int>(it - members.begin());
}

double calc_mass(const Plan& plan, const Member& m) {
  switch (m.kind) {
    case MemberKind::Column: {
      const Section& s = section_of(plan, m);
      return plan.concretes[static_cast<size_t>(s.concrete)].density * s.area() * norm(m.end - m.start);
    }
    case MemberKind::Beam: {
      // each half of the width ends below the slab on its side
      const Section& s = section_of(plan, m);
      const auto height = [&](bool left) { return std::max(0.0, s.height - calc_slab_beside(plan, m, left)); };
      const double area = s.width * (height(true) + height(false)) / 2;
      return plan.concretes[static_cast<size_t>(s.concrete)].density * area * std::max(0.0, calc_clear_length(plan, m));
    }
    case MemberKind::Slab: {
      double area = (m.end.x - m.start.x) * (m.end.y - m.start.y);
      for (const int row : {m.row_a, m.row_b})
        for (const int frame : {m.frame_a, m.frame_b})
          area -=
              calc_half_column(plan, m.storey, row, frame, true) * calc_half_column(plan, m.storey, row, frame, false);
      const Panel& p = panel_of(plan, m);
      return p.density * p.thickness * std::max(0.0, area);
    }
    case MemberKind::Wall: {
      double area = std::max(0.0, calc_clear_length(plan, m)) * m.height;
      for (const Opening& o : m.openings) area -= o.width * o.height;
      const Panel& p = panel_of(plan, m);
      return p.density * p.thickness * std::max(0.0, area);
    }
    case MemberKind::Shaft:
      return calc_shaft_mass(plan, plan.shafts[static_cast<size_t>(m.shaft)], norm(m.end - m.start), 0, 1);
  }
  return 0;
}

bool is_all_around(double opening) { return opening > 2 * pi - 1e-6; }

bool is_in_sector(double angle, double azimuth, double opening) {
  return is_all_around(opening) || std::abs(std::remainder(angle - azimuth, 2 * pi)) < 0.5 * opening;
}

double calc_shaft_mass(const Plan& plan, const Shaft& s, double height, double from, double to) {
  const double density = s.concrete < 0 ? s.density : plan.concretes[static_cast<size_t>(s.concrete)].density;
  // areas are quadratic along the axis: Simpson's rule is exact
  const auto per_length = [&](double share) {
    const double outer = s.outer(share), inner = outer - s.thickness(share), bare = inner - s.lining_thickness;
    return density * pi * (outer * outer - inner * inner) + s.lining_density * pi * (inner * inner - bare * bare);
  };
  double mass = (to - from) * height / 6 * (per_length(from) + 4 * per_length(0.5 * (from + to)) + per_length(to));
  for (const Shaft::Load& load : s.loads) {
    const double at = load.at / height;
    if (at >= from && (at < to || (to >= 1 && at <= to))) mass += load.mass;
  }
  return mass;
}

}  // namespace topple::product
