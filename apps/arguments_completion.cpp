#include "arguments_completion.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

namespace topple::apps {

namespace {

void add_verbs(const CLI::App& app, const std::string& path, std::vector<VerbPath>& out) {
  out.push_back({&app, path});
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; }))
    add_verbs(*verb, path + " " + verb->get_name(), out);
}

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> out{""};
  for (const char c : text)
    if (c == at)
      out.emplace_back();
    else
      out.back() += c;
  return out;
}

std::string join(const std::vector<std::string>& words, const std::string& between = " ") {
  std::string out;
  for (const std::string& w : words) out += (out.empty() ? "" : between) + w;
  return out;
}

/// A text inside '...' of a shell.
std::string quote(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

std::vector<std::string> words_of(const CLI::App& app) {
  std::vector<std::string> out;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; }))
    out.push_back(verb->get_name());
  return out;
}

bool has_files(const CLI::App& app) {
  for (const OptionShape& o : list_options(app))
    if (o.is_positional && (o.takes == Takes::File || o.takes == Takes::Folder)) return true;
  return false;
}

/// Words that a positional may be.
std::vector<std::string> choices_of(const CLI::App& app) {
  std::vector<std::string> out;
  for (const OptionShape& o : list_options(app))
    if (o.is_positional) out.insert(out.end(), o.choices.begin(), o.choices.end());
  return out;
}

std::string make_bash(const std::vector<VerbPath>& verbs) {
  std::string known, values, words;
  for (const auto& [verb, path] : verbs) {
    if (!path.empty()) known += (known.empty() ? "" : " | ") + quote(path);
    std::vector<std::string> options, others = words_of(*verb);
    for (const OptionShape& o : list_options(*verb)) {
      if (o.is_positional) continue;
      options.insert(options.end(), o.names.begin(), o.names.end());
      if (o.takes == Takes::Nothing) continue;
      std::string patterns;
      for (const std::string& name : o.names) {
        if (!patterns.empty()) patterns += " | ";
        patterns += quote(fmt::format("{}:{}", path, name));
      }
      const std::string action = o.takes == Takes::Choice   ? "_topple_words " + quote(join(o.choices))
                                 : o.takes == Takes::File   ? "_topple_files -f"
                                 : o.takes == Takes::Folder ? "_topple_files -d"
                                                            : "COMPREPLY=()";
      values += fmt::format("    {}) {}; return ;;\n", patterns, action);
    }
    for (const std::string& c : choices_of(*verb)) others.push_back(c);
    words += fmt::format("    {}) options={} words={} files={} ;;\n", quote(path), quote(join(options)),
                         quote(join(others)), has_files(*verb) ? "yes" : "''");
  }
  return fmt::format(R"(# bash completion for topple, made by `topple completion bash`
_topple_words() {{ mapfile -t COMPREPLY < <(compgen -W "$1" -- "$current"); }}
_topple_files() {{
  mapfile -t -O "${{#COMPREPLY[@]}}" COMPREPLY < <(compgen "$1" -- "$current")
  compopt -o filenames 2>/dev/null
}}
_topple() {{
  COMPREPLY=()
  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD - 1]}} path= i options= words= files=
  for ((i = 1; i < COMP_CWORD; i++)); do
    case "$path ${{COMP_WORDS[i]}}" in
    {}) path="$path ${{COMP_WORDS[i]}}" ;;
    esac
  done
  # --option=value comes as three words
  if [[ $current == = ]]; then current=
  elif [[ $previous == = ]] && ((COMP_CWORD > 1)); then previous=${{COMP_WORDS[COMP_CWORD - 2]}}
  fi
  case "$path:$previous" in
{}  esac
  case $path in
{}  esac
  if [[ $current == -* ]]; then _topple_words "$options"
  elif [[ -n $words ]]; then _topple_words "$words"
  fi
  if [[ -n $files && $current != -* ]]; then _topple_files -f; fi
}}
complete -F _topple topple
)",
                     known, values, words);
}

/// A text inside a specification of _arguments.
std::string spec_text(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

std::string zsh_action(const OptionShape& o) {
  switch (o.takes) {
    case Takes::Choice:
      return "(" + join(o.choices) + ")";
    case Takes::File:
      return "_files";
    case Takes::Folder:
      return "_files -/";
    default:
      return " ";
  }
}

std::string make_zsh(const std::vector<VerbPath>& verbs) {
  std::string known, cases;
  for (const auto& [verb, path] : verbs) {
    if (!path.empty()) known += (known.empty() ? "" : " | ") + quote(path);
    std::string specs, described;
    const std::vector<OptionShape> options = list_options(*verb);
    const auto positionals =
        std::count_if(options.begin(), options.end(), [](const auto& o) { return o.is_positional; });
    int at = 0;
    for (const OptionShape& o : options) {
      if (o.is_positional) {
        // the last one stands for the rest, of which there may be one only
        const std::string place = ++at < positionals ? std::to_string(at) : "*";
        specs += " " + quote(place + ":" + spec_text(o.names[0]) + ":" + zsh_action(o));
        continue;
      }
      for (const std::string& name : o.names) {
        // each name forbids the others after it
        std::string spec = o.names.size() > 1 ? "(" + join(o.names) + ")" : "";
        spec += name + "[" + spec_text(o.description) + "]";
        if (o.takes != Takes::Nothing) spec += ":value:" + zsh_action(o);
        specs += " " + quote(spec);
      }
    }
    for (const CLI::App* sub : verb->get_subcommands([](const CLI::App*) { return true; }))
      described += " " + quote(spec_text(sub->get_name()) + ":" + sub->get_description());
    cases += fmt::format("    {})\n", quote(path));
    if (!described.empty())
      cases += fmt::format("      [[ $words[CURRENT] == -* ]] || {{ verbs=({}); _describe verb verbs; }}\n",
                           described.substr(1));
    cases += fmt::format("      _arguments -s{} ;;\n", specs);
  }
  return fmt::format(R"(#compdef topple
# zsh completion for topple, made by `topple completion zsh`
_topple() {{
  local place= i=2 at=1
  local -a verbs
  while ((i < CURRENT)); do
    case "$place $words[i]" in
    {}) place="$place $words[i]" at=$i ;;
    esac
    ((i++))
  done
  ((at > 1)) && {{ words=("${{(@)words[at,-1]}}"); ((CURRENT -= at - 1)); }}
  case $place in
{}  esac
}}
if [[ $funcstack[1] == _topple ]]; then _topple "$@"; else compdef _topple topple; fi
)",
                     known, cases);
}

std::string make_fish(const std::vector<VerbPath>& verbs) {
  std::string known, lines;
  for (const auto& [verb, path] : verbs) {
    if (!path.empty()) known += " " + quote(path);
    const std::string here = fmt::format("complete -c topple -n {}", quote("__topple_is_at \"" + path + "\""));
    for (const CLI::App* sub : verb->get_subcommands([](const CLI::App*) { return true; }))
      lines += fmt::format("{} -f -a {} -d {}\n", here, quote(sub->get_name()), quote(sub->get_description()));
    for (const OptionShape& o : list_options(*verb)) {
      if (o.is_positional) {
        if (!o.choices.empty()) lines += fmt::format("{} -f -a {}\n", here, quote(join(o.choices)));
        continue;
      }
      std::string names;
      for (const std::string& name : o.names)
        names += name.rfind("--", 0) == 0 ? " -l " + name.substr(2) : " -s " + name.substr(1);
      const std::string value = o.takes == Takes::Nothing  ? ""
                                : o.takes == Takes::Choice ? " -x -a " + quote(join(o.choices))
                                : o.takes == Takes::File   ? " -r -F"
                                : o.takes == Takes::Folder ? " -x -a '(__fish_complete_directories)'"
                                                           : " -x";
      lines += fmt::format("{}{}{} -d {}\n", here, names, value, quote(o.description));
    }
  }
  return fmt::format(R"(# fish completion for topple, made by `topple completion fish`
function __topple_is_at
    set -l path ''
    set -l words (commandline -opc)
    for word in $words[2..-1]
        if contains -- "$path $word"{}
            set path "$path $word"
        end
    end
    test "$path" = "$argv[1]"
end
{})",
                     known, lines);
}

}  // namespace

std::vector<VerbPath> list_verbs(const CLI::App& app) {
  std::vector<VerbPath> out;
  add_verbs(app, "", out);
  return out;
}

std::vector<OptionShape> list_options(const CLI::App& app) {
  std::vector<OptionShape> out;
  for (const CLI::Option* option : app.get_options()) {
    OptionShape o;
    for (const std::string& name : option->get_snames()) o.names.push_back("-" + name);
    for (const std::string& name : option->get_lnames()) o.names.push_back("--" + name);
    o.is_positional = o.names.empty();
    if (o.is_positional) o.names.push_back(option->get_name());
    o.description = option->get_description();
    o.is_required = option->get_required();
    const std::string type = option->get_type_name();  // "TEXT:{foot,top}", "INT:INT in [1 - 1024]"
    const size_t from = type.find('{'), to = type.rfind('}');
    if (option->get_items_expected_max() == 0) {
      o.takes = Takes::Nothing;
    } else if (from != std::string::npos && to != std::string::npos && to > from) {
      o.takes = Takes::Choice;
      o.choices = split(type.substr(from + 1, to - from - 1), ',');
    } else {
      o.takes = type == "FILE" || type == "PATH"                          ? Takes::File
                : type == "FOLDER"                                        ? Takes::Folder
                : type == "QUANTITY"                                      ? Takes::Quantity
                : type.rfind("INT", 0) == 0 || type.rfind("UINT", 0) == 0 ? Takes::Number
                                                                          : Takes::Word;
    }
    out.push_back(std::move(o));
  }
  return out;
}

std::string make_completion(const CLI::App& app, const std::string& shell) {
  const std::vector<VerbPath> verbs = list_verbs(app);
  return shell == "zsh" ? make_zsh(verbs) : shell == "fish" ? make_fish(verbs) : make_bash(verbs);
}

}  // namespace topple::apps
