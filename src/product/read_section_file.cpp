#include <algorithm>
#include <cmath>

#include "base/utf8.h"
#include "product/reading.h"
#include "product/section_file.h"

namespace topple::product {

namespace {

constexpr size_t most_forces = 50;

/// Compression is positive in the file.
std::vector<double> read_forces(TableReader& zone) {
  std::vector<double> list;
  const Node* node = zone.find("normal_force");
  if (!node) return list;
  const std::string label = zone.label() + ": normal_force";
  constexpr Range forces{-1e12, 1e12};
  if (node->kind != Node::Kind::Array) {
    list.push_back(-read_quantity(*node, label, Dimension::Force, forces, zone.complaints()));
    return list;
  }
  if (node->items.empty() || node->items.size() > most_forces) {
    zone.error("E209", node->place, "normal_force: holds " + std::to_string(node->items.size()) + " forces",
               "allowed: between 1 and " + std::to_string(most_forces));
    return list;
  }
  for (const Node& item : node->items)
    list.push_back(-read_quantity(item, label, Dimension::Force, forces, zone.complaints()));
  return list;
}

void read_zone(const Reading& reading, TableReader& root, SectionFile& out) {
  const Node* node = root.table("zone");
  if (!node) return;
  TableReader zone(*node, "zone", reading.complaints);
  if (const auto length = zone.find_quantity("length", Dimension::Length, {0.01, 20})) {
    out.length = *length;
    out.has_length = true;
    out.where_length = reading.complaints.position(zone.place_of("length"));
  }
  out.normal_forces = read_forces(zone);
  out.cut_bars = zone.quantity("cut_bars", Dimension::Number, fraction, 0);
  out.cut_concrete = zone.quantity("cut_concrete", Dimension::Number, {0, 0.95}, 0);
  out.concrete_loss = zone.quantity("transition_damage", Dimension::Number, fraction, 0);
  out.cover_lost = zone.find_flag("cover_lost").value_or(false);
  if (out.cut_bars == 1 && out.concrete_loss == 1)
    zone.error("E205", zone.place_of("cut_bars"),
               "zone: without bars (cut_bars) and strength of the concrete (transition_damage) nothing is left",
               "leave some of one of them");
  zone.finish();
}

}  // namespace

SectionFile read_section_file_text(const std::string& text, const std::string& name,
                                   std::vector<Diagnostic>& warnings) {
  const std::string bytes(without_mark(text));
  const Node document =
      parse_document(bytes, name, "the section file",
                     "it wants [concrete.NAME], [steel.NAME] and [section.NAME]; docs/rcc.md has one");
  SectionFile out = read_section_document(document, name, warnings);
  out.text = bytes;
  return out;
}

SectionFile read_section_document(const Node& document, const std::string& name, std::vector<Diagnostic>& warnings) {
  SectionFile out;
  out.path = name;
  Complaints complaints(name);
  for (const char* key : {"grid", "storeys", "columns"})
    if (const Entry* entry = document.find(key)) {
      complaints.error("E203", entry->place, "this is a plan; a section file has no " + quoted(key),
                       "name a member of it: topple rcc " + name + " --member C-A1-0");
      throw InputError(complaints.all());
    }
  Plan plan;
  Reading reading{plan, complaints, {}, {}, {}, {}, {}, false, true, {}, {}, {}, {}, {}, {}};
  TableReader root(document, "", complaints);
  out.title = root.text("title", "untitled");
  read_materials(reading, root);
  read_sections(reading, root);
  read_zone(reading, root, out);
  root.finish();
  if (plan.sections.size() > 1)
    complaints.error("E209", reading.section_places[1], "a section file describes one section",
                     "one file for each section; of a plan: topple rcc plan.toml --member NAME");
  if (plan.sections.empty() && complaints.error_count() == 0)
    complaints.error("E201", root.place_of("section"), "no section is described", "describe one under [section.NAME]");
  complaints.sort();
  if (complaints.error_count() > 0) throw InputError(complaints.all());
  warnings.insert(warnings.end(), complaints.all().begin(), complaints.all().end());

  out.section = plan.sections.front();
  out.concrete = plan.concretes[static_cast<size_t>(out.section.concrete)];
  out.steel = plan.steels[static_cast<size_t>(out.section.steel)];
  out.where = complaints.position(reading.section_places.front());
  if (!out.has_length) {
    out.length = std::max(out.section.width, out.section.height);
    out.where_length = out.where;
  }
  return out;
}

SectionFile read_section_file(const std::string& path, std::vector<Diagnostic>& warnings, std::string& text_out) {
  text_out.clear();
  text_out = without_mark(read_input(path, "section"));
  return read_section_file_text(text_out, path, warnings);
}

}  // namespace topple::product
