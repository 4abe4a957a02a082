#include "product/templates.h"

#include <algorithm>

#include "base/error.h"
#include "product/template_texts.h"

namespace topple::product {

namespace {

struct Words {
  const char *name, *title, *description;
};

constexpr Words words[] = {
    {"frame", "Frame building", "Reinforced concrete frames of three storeys, toppled to the front by two stages."},
    {"wall", "Wall building", "Large panels under five floors, brought down on themselves by three stages."},
    {"hall", "Industrial hall", "Girders on two rows of columns, tilted about the rear row."},
    {"silo", "Silo on columns", "A box of reinforced concrete on nine columns, toppled over its rear row."},
    {"chimney", "Chimney", "60 m of reinforced concrete with a lining, felled over a notch with slits at its ends."},
    {"tower", "Water tower", "A shaft with a tank on top, felled over a notch that opens in two steps."},
};

std::vector<Template> make_templates() {
  std::vector<Template> all;
  for (const Words& w : words) {
    const auto text = std::find_if(std::begin(kTemplateTexts), std::end(kTemplateTexts),
                                   [&](const TemplateText& t) { return std::string(t.name) == w.name; });
    if (text != std::end(kTemplateTexts)) all.push_back({w.name, w.title, w.description, text->text});
  }
  return all;
}

}  // namespace

const std::vector<Template>& templates() {
  static const std::vector<Template> all = make_templates();
  return all;
}

const Template& find_template(const std::string& name) {
  std::vector<std::string> names;
  for (const Template& t : templates()) {
    if (t.name == name) return t;
    names.push_back(t.name);
  }
  const std::string near = nearest_name(name, names);
  std::string list;
  for (const std::string& n : names) list += (list.empty() ? "" : ", ") + n;
  throw InputError("E920", "there is no template \"" + name + "\"",
                   (near.empty() ? "" : "did you mean \"" + near + "\"? ") + std::string("there are: ") + list);
}

}  // namespace topple::product
