#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "product/plan_limits.h"
#include "product/reading.h"

namespace topple::product {

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr size_t most_stages = 1000;
constexpr size_t most_charges = 20000;  // over all stages
constexpr double largest_scatter = 3;   // deviations, as in the rule charge.scatter_limit
constexpr const char* no_support = "nothing removes a support; the building will stand";

std::string in_metres(double length) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g m", length);
  return text;
}

/// What a charge table says, before it is spread over its members.
struct ChargeTable {
  std::vector<Word> words;
  Charge charge;
  Place place;
};

ChargeTable read_charge(TableReader& table) {
  ChargeTable c;
  c.place = table.place();
  c.words = table.required_words("members", "[\"C-A*-0\"]");
  c.charge.position = table.quantity("position", Dimension::Length, {0, 1000});
  c.charge.destroyed_length = table.quantity("destroyed_length", Dimension::Length, limits::destroyed_length);
  c.charge.residual_bars = table.quantity("residual_bars", Dimension::Number, fraction, 0);
  c.charge.residual_concrete = table.quantity("residual_concrete", Dimension::Number, limits::residual_concrete, 0);
  c.charge.transition_damage = table.quantity("transition_damage", Dimension::Number, fraction, 0);
  if (c.charge.residual_concrete > 0 && c.charge.residual_bars == 0 && c.charge.transition_damage == 1)
    table.error("E205", table.place_of("residual_concrete"),
                "residual_concrete: of concrete without strength (transition_damage) and no bars nothing is left",
                "leave it out: the charge then destroys all");
  const Sector sector = read_sector(table);
  c.charge.azimuth = sector.azimuth, c.charge.opening = sector.opening;
  c.charge.delay = table.quantity("delay", Dimension::Time, {0, 600}, 0);
  c.charge.scatter = table.quantity("scatter", Dimension::Time, {0, 1}, 0);
  c.charge.fails = table.find_flag("fails").value_or(false);
  c.charge.where = table.complaints().position(c.place);
  table.finish();
  return c;
}

class Blasting {
 public:
  Blasting(Reading& reading) : reading_(reading), fired_(reading.plan.members.size()) {}

  /// Puts a charge on each of its members; complains once for each kind of mistake.
  void spread(TableReader& table, const ChargeTable& from, Stage& stage) {
    bool is_misplaced = false, is_outside = false, is_removed = false, is_overlapping = false;
    for (const int index : find_members(reading_, table, "members", from.words)) {
      const Member& m = reading_.plan.members[static_cast<size_t>(index)];
      Charge charge = from.charge;
      charge.member = index;
      if (m.kind != MemberKind::Column && m.kind != MemberKind::Beam && m.kind != MemberKind::Shaft) {
        if (!std::exchange(is_misplaced, true))
          table.error("E307", table.place_of("members"), m.name + " is neither a column nor a beam nor a shaft",
                      "charges fire in columns, beams and shafts; take walls out under [preparation]");
        continue;
      }
      if (charge.residual_concrete > 0 && !can_keep_concrete(m)) {
        if (!std::exchange(is_misplaced, true))
          table.error("E307", table.place_of("residual_concrete"),
                      m.name + " is neither a column of the ground storey nor a beam along x",
                      "what a charge leaves of the concrete is known of these; take it out there");
        continue;
      }
      if (!is_misplaced && !check_sector(table, m)) is_misplaced = true;
      if (m.removed && !std::exchange(is_removed, true))
        table.error("E403", table.place_of("members"), m.name + " is taken out in the preparation",
                    "leave it out here, or keep it standing");
      const double low = charge.position - charge.destroyed_length / 2, high = low + charge.destroyed_length;
      if ((low < -round_off || high > calc_length(m) + round_off) && !std::exchange(is_outside, true))
        table.error("E405", table.place_of("position"),
                    "the destroyed length, " + in_metres(low) + " to " + in_metres(high) + ", reaches out of " + m.name,
                    "it is " + in_metres(calc_length(m)) + " long; position is the middle of the destroyed length");
      for (const Fired& other : fired_[static_cast<size_t>(index)]) {
        if ((charge.residual_concrete > 0 || other.keeps_concrete) && !is_overlapping) {
          is_overlapping = true;
          table.error("E404", table.place_of("members"), m.name + " has another charge, and one leaves concrete",
                      "a charge with residual_concrete is the only one of its member");
          continue;
        }
        if (!(low < other.high - round_off && other.low < high - round_off) || is_overlapping) continue;
        const double apart = std::abs(std::remainder(other.azimuth - charge.azimuth, 2 * pi));
        const double least = 0.5 * (other.opening + charge.opening);
        if (std::isnan(apart - least)) continue;  // complained of
        if (m.kind == MemberKind::Shaft && apart >= least - 1e-9) {
          if (std::abs(low - other.low) < round_off && std::abs(high - other.high) < round_off) continue;
          is_overlapping = true;
          table.error("E404", table.place_of("position"),
                      m.name + " has another charge beside this one, not at the same height",
                      "charges of one mouth have the same position and destroyed_length");
          continue;
        }
        is_overlapping = true;
        table.error("E404", table.place_of("members"), m.name + " has another charge on the same length",
                    "leave one of them out, or move them apart");
      }
      fired_[static_cast<size_t>(index)].push_back(
          {low, high, charge.azimuth, charge.opening, charge.residual_concrete > 0});
      if (++count_ > most_charges) {
        if (count_ == most_charges + 1)
          table.error("E209", from.place, "more than " + std::to_string(most_charges) + " charges");
        return;
      }
      if (m.kind != MemberKind::Beam) (charge.fails ? failing_columns_ : fired_columns_) += 1;
      stage.charges.push_back(std::move(charge));
    }
  }

  size_t count() const { return count_; }
  int fired_columns() const { return fired_columns_; }
  int failing_columns() const { return failing_columns_; }

 private:
  struct Fired {
    double low = 0, high = 0, azimuth = 0, opening = 0;
    bool keeps_concrete = false;
  };
  Reading& reading_;
  std::vector<std::vector<Fired>> fired_;  // destroyed lengths of each member
  size_t count_ = 0;
  int fired_columns_ = 0, failing_columns_ = 0;
};

/// When a table of charges fires.
struct Firing {
  size_t stage = 0;
  double delay = 0;
  Place place;
};

void check_times(Reading& reading, const std::vector<const Node*>& nodes, const std::vector<Firing>& firings) {
  const std::vector<Stage>& stages = reading.plan.stages;
  Complaints& complaints = reading.complaints;
  const auto place_of_time = [&](size_t i) {
    const Entry* entry = nodes[i]->find("time");
    return entry ? entry->value.place : nodes[i]->place;
  };
  for (size_t i = 1; i < stages.size(); ++i)
    if (stages[i].time <= stages[i - 1].time + round_off)
      complaints.error("E402", place_of_time(i),
                       "stage[" + std::to_string(i) + "]: time: is not after the stage before it",
                       "stages are given in the order in which they fire");
  const double duration = reading.plan.analysis.duration;
  for (size_t i = 0; i < stages.size(); ++i)
    if (stages[i].time >= duration)
      complaints.error("E407", place_of_time(i), "time: the stage fires at or after the end of the analysis",
                       "raise duration in [analysis], or fire earlier");
  for (const Firing& firing : firings) {
    const double time = stages[firing.stage].time, next = time + firing.delay;
    const bool has_next = firing.stage + 1 < stages.size();
    if (time >= duration) continue;
    if (next >= duration) {
      complaints.error("E407", firing.place, "the charge fires at or after the end of the analysis",
                       "raise duration in [analysis], or shorten its delay");
    } else if (has_next && stages[firing.stage + 1].time > time && next >= stages[firing.stage + 1].time) {
      complaints.warn("W506", firing.place, "the charge's delay lasts until the next stage or longer");
    }
  }
  for (size_t i = 0; i < stages.size(); ++i) {
    size_t late = 0;
    double latest = 0;
    for (const Charge& c : stages[i].charges) {
      const double time = stages[i].time + c.delay, last = time + largest_scatter * c.scatter;
      if (c.fails || !(time < duration && last >= duration)) continue;
      ++late, latest = std::max(latest, last);
    }
    if (late == 0) continue;
    char until[32];
    std::snprintf(until, sizeof until, "%.4g s", latest);
    complaints.warn("W509", place_of_time(i),
                    "time: the scatter of " + std::to_string(late) + (late == 1 ? " charge" : " charges") +
                        " may lead past the end of the analysis; what is late does not fire",
                    std::string("they fire until ") + until +
                        "; raise duration in [analysis], or fire earlier or with less scatter");
  }
}

}  // namespace

void read_stages(Reading& reading, TableReader& root) {
  const std::vector<const Node*> nodes = root.tables("stage");
  if (nodes.empty() && !root.has("stage")) {
    reading.complaints.warn("W501", root.place(), "the plan has no charges: the building is only checked for standing");
    return;
  }
  if (nodes.size() > most_stages) {
    root.error("E209", nodes[most_stages]->place, "more than " + std::to_string(most_stages) + " stages");
    return;
  }
  const int errors_before = reading.complaints.error_count();
  Blasting blasting(reading);
  std::vector<Firing> firings;
  for (size_t i = 0; i < nodes.size(); ++i) {
    TableReader table(*nodes[i], "stage[" + std::to_string(i) + "]", reading.complaints);
    Stage stage;
    stage.name = table.text("name", "stage " + std::to_string(i + 1));
    stage.time = table.quantity("time", Dimension::Time, {0, 600});
    stage.where = reading.complaints.position(nodes[i]->place);
    const std::vector<const Node*> charges = table.tables("charge");
    if (charges.empty() && table.is_table() && !table.has("charge"))
      table.error("E406", nodes[i]->place, "the stage has no charge", "add [[stage.charge]] below it");
    for (size_t k = 0; k < charges.size() && !reading.complaints.is_full(); ++k) {
      TableReader charge(*charges[k], "charge[" + std::to_string(k) + "]", reading.complaints);
      const ChargeTable values = read_charge(charge);
      const Entry* delay = charges[k]->find("delay");
      firings.push_back({i, values.charge.delay, delay != nullptr ? delay->value.place : values.place});
      if (reading.has_grid && blasting.count() <= most_charges) blasting.spread(charge, values, stage);
    }
    table.finish();
    reading.plan.stages.push_back(std::move(stage));
  }
  check_times(reading, nodes, firings);
  if (reading.complaints.error_count() != errors_before || !reading.has_grid || !reading.knows_members || nodes.empty())
    return;
  if (blasting.fired_columns() == 0) {
    const std::string help = "put charges on columns, such as members = [\"C-A*-0\"], or leave out every [[stage]]";
    if (blasting.failing_columns() > 0) {
      reading.complaints.warn("W504", nodes[0]->place, std::string("every charge on a column fails: ") + no_support);
    } else {
      reading.complaints.error("E401", nodes[0]->place, no_support, help);
    }
  }
}

void read_cables(Reading& reading, TableReader& root) {
  const std::vector<const Node*> nodes = root.tables("cable");
  for (size_t i = 0; i < nodes.size() && !reading.complaints.is_full(); ++i) {
    TableReader table(*nodes[i], "cable[" + std::to_string(i) + "]", reading.complaints);
    Cable c;
    c.name = table.text("name", "cable " + std::to_string(i + 1));
    c.where = reading.complaints.position(nodes[i]->place);
    const auto& others = reading.plan.cables;
    if (std::any_of(others.begin(), others.end(), [&c](const Cable& other) { return other.name == c.name; }))
      table.error("E208", table.find("name") ? table.place_of("name") : nodes[i]->place,
                  "name: another cable is called " + quoted(c.name), "results tell cables by their names");
    const std::string member = table.text("member");
    c.position = table.quantity("position", Dimension::Length, {0, 1000});
    const Node* anchor = table.find("anchor");
    const std::string help = "write x, y and z, such as anchor = [\"-40 m\", \"10 m\", \"0 m\"]";
    if (!anchor) {
      table.missing("anchor", help);
    } else if (anchor->kind != Node::Kind::Array || anchor->items.size() != 3) {
      table.error("E202", anchor->place, "anchor: is not a list of three lengths", help);
    } else {
      for (int k = 0; k < 3; ++k)
        c.anchor[k] = read_quantity(anchor->items[static_cast<size_t>(k)], table.label() + ": anchor",
                                    Dimension::Length, limits::site, reading.complaints);
    }
    c.stiffness = table.quantity("stiffness", Dimension::StiffnessPerLength, limits::cable_stiffness);
    c.pretension = table.quantity("pretension", Dimension::Force, limits::cable_pretension, 0);
    c.strength = table.quantity("strength", Dimension::Force, {0, 1e9, true});
    table.finish();
    if (c.strength <= c.pretension)
      table.error("E207", table.place_of("strength"), "strength: must be above the pretension");
    if (reading.has_grid && !member.empty()) {
      const std::vector<int> found = find_members(reading, table, "member", {{member, table.place_of("member")}});
      if (found.size() > 1) {
        table.error("E307", table.place_of("member"),
                    "member: a cable pulls one member, not " + std::to_string(found.size()));
      } else if (found.size() == 1) {
        const Member& m = reading.plan.members[static_cast<size_t>(found[0])];
        c.member = found[0];
        if (m.kind != MemberKind::Column && m.kind != MemberKind::Beam && m.kind != MemberKind::Shaft) {
          table.error("E307", table.place_of("member"), m.name + " is neither a column nor a beam nor a shaft");
        } else if (m.removed) {
          table.error("E403", table.place_of("member"), m.name + " is taken out in the preparation");
        } else if (c.position > calc_length(m) + round_off) {
          table.error("E306", table.place_of("position"), "position: lies beyond the end of " + m.name,
                      "it is " + in_metres(calc_length(m)) + " long");
        } else if (anchor && norm(m.start + (c.position / calc_length(m)) * (m.end - m.start) - c.anchor) < unit::mm) {
          table.error("E207", anchor->place, "anchor: is where the cable is tied to " + m.name,
                      "a cable without length pulls in no direction");
        }
      }
    }
    reading.plan.cables.push_back(std::move(c));
  }
}

}  // namespace topple::product
