/// What the summary tells about joints that repeat each other, singular positions and starts that do not fit.

#include "mbs/joint_notes.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/words.h"
#include "mbs/system.h"

namespace topple::mbs {

std::string list_joints(const Model& model, std::vector<int> list) {
  std::sort(list.begin(), list.end());
  constexpr size_t most = 6;
  std::string out = list.size() == 1 ? "joint " : "joints ";
  for (size_t i = 0; i < std::min(list.size(), most); ++i) {
    const std::string& name = model.joints[static_cast<size_t>(list[i])].name;
    out += (i > 0 ? ", " : "") + (name.empty() ? "number " + std::to_string(list[i]) : "\"" + name + "\"");
  }
  if (list.size() > most) out += " and " + std::to_string(list.size() - most) + " more";
  return out;
}

namespace {

// situations; a positive number is that of the rows that repeat others
constexpr int kSingular = -1, kOpen = -2, kSpeed = -3, kTurn = -4;

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

/// The joints whose rows take part in repeating others.
std::vector<int> repeating(const JointCluster& c) {
  const std::vector<double>& null = c.matrix.null_space();
  const size_t n = static_cast<size_t>(c.matrix.rows());
  std::vector<int> out;
  for (size_t i = 0; i < c.joints.size(); ++i) {
    const size_t first = static_cast<size_t>(c.matrix.first_row(static_cast<int>(i)));
    const size_t last = i + 1 < c.joints.size() ? static_cast<size_t>(c.matrix.first_row(static_cast<int>(i) + 1)) : n;
    double most = 0;
    for (size_t v = 0; v < null.size(); v += n)
      for (size_t r = first; r < last; ++r) most = std::max(most, std::abs(null[v + r]));
    if (most > 1e-6) out.push_back(c.joints[i]);
  }
  return out;
}

}  // namespace

bool System::note_once(const JointCluster& c, int situation) {
  const std::pair<int, int> key{*std::min_element(c.joints.begin(), c.joints.end()), situation};
  if (std::find(joint_notes.begin(), joint_notes.end(), key) != joint_notes.end()) return false;
  joint_notes.push_back(key);
  return true;
}

bool System::was_singular(const JointCluster& c) const {
  const int first = *std::min_element(c.joints.begin(), c.joints.end());
  return std::any_of(joint_notes.begin(), joint_notes.end(), [&](const auto& note) {
    return note.first == first && (note.second == kSingular || note.second > c.dependent);
  });
}

void System::note_dependence(const JointCluster& c, int usual) {
  if (c.dependent == 0) return;
  // what was told first is usual
  const int first = *std::min_element(c.joints.begin(), c.joints.end());
  for (const auto& [joint, situation] : joint_notes)
    if (joint == first && situation > 0) usual = std::min(usual, situation);
  if (c.dependent <= usual) {
    if (!note_once(c, c.dependent)) return;
    summary.notes.push_back(list_joints(model, repeating(c)) + ": " + count_words(c.dependent, "constraint") + " of " +
                            std::to_string(c.matrix.rows()) + (c.dependent == 1 ? " repeats" : " repeat") +
                            " what the others hold; of all reactions that give the same motion the smallest are given");
  } else if (note_once(c, kSingular)) {
    summary.notes.push_back(list_joints(model, repeating(c)) + ": singular position at " + number(state.time) +
                            " s, where " + count_words(c.dependent - usual, "further constraint") +
                            " cannot be told from the others; left out of the step, so that the motion goes on along "
                            "the branch it is on");
  }
}

void System::note_open(const JointCluster& c) {
  if (!note_once(c, kOpen)) return;
  summary.notes.push_back(list_joints(model, c.joints) + ": the step at " + number(state.time) + " s left a gap of " +
                          number(c.open) + " m or rad; a shorter step may close it");
}

void System::note_turn(const JointCluster& c, double turn) {
  if (!note_once(c, kTurn)) return;
  summary.notes.push_back(list_joints(model, c.joints) + ": in the step at " + number(state.time) +
                          " s a body turns by " + number(turn) + " rad, too far for the joints to be solved as " +
                          "elsewhere; a shorter step may do");
}

void System::stop_if_lost(const JointCluster& c) {
  constexpr double most = 0.01;  // of the length of what it joins
  if (c.open > most * c.length && trouble.empty())
    trouble = list_joints(model, c.joints) + " could not be closed: a gap of " + number(c.open) + " m or rad is left";
}

void System::note_speed(const JointCluster& c, double speed) {
  if (!note_once(c, kSpeed)) return;
  summary.notes.push_back(list_joints(model, c.joints) +
                          ": the bodies' velocities at the start disagree with the joints by up to " + number(speed) +
                          " m/s; impulses of the joints made them agree");
}

}  // namespace topple::mbs
