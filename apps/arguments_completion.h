#pragma once
/// Shell completion out of the table that the parser reads.

#include <CLI/App.hpp>
#include <string>
#include <vector>

namespace topple::apps {

/// A verb and how it is typed after "topple", " mbs run"; the program itself is "".
struct VerbPath {
  const CLI::App* verb;
  std::string path;
};
/// The program and all its verbs, depth first, as they were added.
std::vector<VerbPath> list_verbs(const CLI::App&);

/// What an option takes; a file may be a folder where either will do.
enum class Takes { Nothing, Word, Choice, Number, Quantity, File, Folder };
struct OptionShape {
  std::vector<std::string> names;  // "-o", "--output"; a positional has its own: "plan"
  std::string description;
  bool is_positional = false, is_required = false;
  Takes takes = Takes::Nothing;
  std::vector<std::string> choices;
};
/// Options and positionals of a verb, -h included, as they were added.
std::vector<OptionShape> list_options(const CLI::App&);

/// A script for "bash", "zsh" or "fish".
std::string make_completion(const CLI::App&, const std::string& shell);

}  // namespace topple::apps
