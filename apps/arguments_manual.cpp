#include "arguments_manual.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <sstream>

#include "arguments_completion.h"

namespace topple::apps {

namespace {

/// A text for roff: hyphens that can be copied, no accidental requests.
std::string escape(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
  }
  return !out.empty() && (out[0] == '.' || out[0] == '\'') ? "\\&" + out : out;
}

std::string value_word(const OptionShape& o) {
  switch (o.takes) {
    case Takes::Nothing:
      return "";
    case Takes::Choice: {
      std::string all;
      for (const std::string& c : o.choices) all += (all.empty() ? "" : "|") + c;
      return all;
    }
    case Takes::Number:
      return "number";
    case Takes::Quantity:
      return "quantity";
    case Takes::File:
      return "file";
    case Takes::Folder:
      return "folder";
    case Takes::Word:
      return "value";
  }
  return "";
}

void add_options(const CLI::App& verb, std::string& out) {
  for (const OptionShape& o : list_options(verb)) {
    out += ".TP\n";
    if (o.is_positional) {
      out += fmt::format(".I {}\n", escape(o.names[0]));
    } else {
      std::string names;
      for (const std::string& name : o.names)
        names += (names.empty() ? "" : ", ") + fmt::format("\\fB{}\\fR", escape(name));
      const std::string value = value_word(o);
      out += names + (value.empty() ? "" : fmt::format(" \\fI{}\\fR", escape(value))) + "\n";
    }
    out += escape(o.description) + "\n";
  }
}

void add_examples(const std::string& footer, std::string& out) {
  std::istringstream in(footer);
  bool inside = false;
  std::string lines;
  for (std::string line; std::getline(in, line);) {
    if (line == "Examples:")
      inside = true;
    else if (line.empty())
      inside = false;
    else if (inside)
      lines += escape(line.substr(std::min<size_t>(2, line.size()))) + "\n";
  }
  if (!lines.empty()) out += ".PP\n.nf\n" + lines + ".fi\n";
}

}  // namespace

std::string make_manual(const CLI::App& app) {
  std::string out = fmt::format(".TH TOPPLE 1 {} \"topple {}\" \"User Commands\"\n", TOPPLE_DATE, TOPPLE_VERSION);
  out += ".SH NAME\ntopple \\- show how a building comes down when it is blasted\n";
  out += ".SH SYNOPSIS\n";
  bool is_first = true;
  for (const auto& [verb, path] : list_verbs(app)) {
    if (path.empty() || (verb->get_require_subcommand_min() > 0)) continue;
    std::string line = fmt::format("\\fBtopple{}\\fR", escape(path));
    bool has_options = false;
    for (const OptionShape& o : list_options(*verb)) {
      if (o.is_positional)
        line +=
            (o.is_required ? " " : " [") + fmt::format("\\fI{}\\fR", escape(o.names[0])) + (o.is_required ? "" : "]");
      else if (o.is_required)
        line += fmt::format(" \\fB{}\\fR \\fI{}\\fR", escape(o.names[0]), escape(value_word(o)));
      else
        has_options = true;
    }
    out += (is_first ? "" : ".br\n") + line + (has_options ? " [options]" : "") + "\n";
    is_first = false;
  }
  out +=
      ".SH DESCRIPTION\n" + escape(app.get_description()) +
      "\nIt reads a plan (what stands where, what is blasted when), builds a multibody model of it, lets that come "
      "down and says\nwhat was found: mechanism, stability, direction, debris, distances to neighbours, touchdowns.\n";
  out += ".SH COMMANDS\n";
  for (const auto& [verb, path] : list_verbs(app)) {
    if (path.empty()) continue;
    out += fmt::format(".SS topple{}\n{}\n", escape(path), escape(verb->get_description()));
    add_options(*verb, out);
    add_examples(verb->get_footer(), out);
  }
  out += ".SH OPTIONS\n";
  add_options(app, out);
  out += R"(.SH "EXIT STATUS"
.TP
.B 0
done
.TP
.B 1
the run failed or was cancelled
.TP
.B 2
bad input
.TP
.B 3
a criterion of the plan is violated, or the run ended too early to judge it
.SH ENVIRONMENT
.TP
.B NO_COLOR
no colours, if it is set and not empty
.SH EXAMPLES
)";
  std::string examples;
  add_examples(app.get_footer(), examples);
  out += examples.substr(examples.find('\n') + 1);
  out +=
      ".SH NOTES\nA quantity is a number with its unit, such as \"250 ms\". No distance that topple gives is a safe "
      "distance.\n";
  return out;
}

}  // namespace topple::apps
