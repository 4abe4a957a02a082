#include "product/templates.h"

#include <algorithm>

#include "base/error.h"
#include "product/plan.h"
#include "product/template_texts.h"

namespace topple::product {

namespace {

struct Words {
  const char *name, *title, *description;
};

constexpr Words words[] = {
    {"frame", "Frame building", "Reinforced concrete frames of three storeys, toppled to the front by two stages."},
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

std::string plan_template() { return templates().front().text; }

}  // namespace topple::product
