#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "base/utf8.h"
#include "product/reading.h"

namespace topple::product {

namespace {

constexpr std::uintmax_t largest_file = 8u << 20;

/// Every "?" is a place that somebody still has to fill in.
void find_gaps(const Node& node, const std::string& path, Complaints& complaints) {
  if (node.kind == Node::Kind::String && node.text == "?")
    complaints.error("E211", node.place, path + ": is a gap", "write what it is; nothing is checked or run before");
  for (size_t i = 0; i < node.items.size(); ++i)
    find_gaps(node.items[i], path + "[" + std::to_string(i) + "]", complaints);
  for (const Entry& e : node.entries) find_gaps(e.value, path.empty() ? e.key : path + "." + e.key, complaints);
}

}  // namespace

Plan read_plan_document(const Node& document, const std::string& name, Complaints& complaints, bool is_sample) {
  Plan plan;
  plan.path = name;
  std::vector<AskedQuantity> asked;
  const bool is_fuzzy = !is_sample && document.find("fuzzy");
  if (is_fuzzy) complaints.asked = &asked;
  Reading reading{plan, complaints, {}, {}, {}, {}, {}, false, true, {}, {}, {}, {}, {}, {}};
  TableReader root(document, "", complaints);
  plan.title = root.text("title", "untitled");
  read_site(reading, root);
  read_materials(reading, root);
  read_sections(reading, root);
  read_panels(reading, root);
  read_grid(reading, root);
  read_members(reading, root);
  read_shafts(reading, root);
  read_preparation(reading, root);
  check_shafts(reading);
  check_neighbours(reading);
  read_analysis(reading, root);
  read_stages(reading, root);
  read_cables(reading, root);
  read_criteria(reading, root);
  complaints.asked = nullptr;
  if (is_sample) {
    root.find("fuzzy");
  } else {
    read_fuzzy(reading, root, document, asked, complaints.error_count() == 0);
  }
  root.finish();
  return plan;
}

Plan read_plan(const std::string& text, const std::string& name, std::vector<Diagnostic>& warnings) {
  if (text.size() > largest_file)
    throw InputError(std::vector<Diagnostic>{
        {Severity::Error, "E107", {name, 1, 1}, 1, "the plan is larger than 8 MB", "a plan describes one building"}});
  std::string bytes(without_mark(text));
  const Node document = parse_document(bytes, name);
  Complaints complaints(name);
  find_gaps(document, "", complaints);
  if (complaints.error_count() > 0) {
    complaints.sort();
    throw InputError(complaints.all());
  }
  Plan plan = read_plan_document(document, name, complaints, false);
  plan.text = std::move(bytes);
  if (complaints.error_count() == 0) try_samples(plan, document, complaints);
  complaints.sort();
  if (complaints.error_count() > 0) throw InputError(complaints.all());
  warnings.insert(warnings.end(), complaints.all().begin(), complaints.all().end());
  return plan;
}

std::string read_input(const std::string& path, const std::string& what) {
  namespace fs = std::filesystem;
  const auto fail = [&](const char* code, const std::string& message, const std::string& help = {}) {
    throw InputError(std::vector<Diagnostic>{{Severity::Error, code, {path, 0, 0}, 1, message, help}});
  };
  std::error_code status;
  if (fs::is_directory(path, status))
    fail("E106", "is a folder; a " + what + " file is wanted", "give a path of a TOML file");
  std::ifstream file(path, std::ios::binary);
  if (!file) fail("E106", "cannot be read: " + std::generic_category().message(errno ? errno : ENOENT));
  // not by the file's size: a pipe or a device has none
  std::string bytes;
  char block[1 << 16];
  while (file.read(block, sizeof block) || file.gcount() > 0) {
    bytes.append(block, static_cast<size_t>(file.gcount()));
    if (bytes.size() > largest_file) fail("E107", "the " + what + " is larger than 8 MB");
  }
  if (file.bad()) fail("E106", "cannot be read to its end");
  return bytes;
}

Plan read_plan_file(const std::string& path, std::vector<Diagnostic>& warnings, std::string& text_out) {
  text_out.clear();
  const std::string bytes = read_input(path, "plan");
  text_out = without_mark(bytes);
  return read_plan(bytes, path, warnings);
}

}  // namespace topple::product
