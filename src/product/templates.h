#pragma once
/// Commented plans to begin with, one for each kind of structure; each passes `topple check` and runs.

#include <string>
#include <vector>

namespace topple::product {

struct Template {
  std::string name;         // a word for the command line: "frame"
  std::string title;        // a few words: "Frame building"
  std::string description;  // a sentence about what the plan shows
  std::string text;         // the plan, as in examples/templates/NAME.toml
};

/// All templates, the one to begin with first.
const std::vector<Template>& templates();

/// The template of this name. Throws InputError with the names that there are.
const Template& find_template(const std::string& name);

}  // namespace topple::product
