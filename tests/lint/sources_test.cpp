// Who may include whom (cmake/layers.txt is the rule; the includes and src/CMakeLists.txt follow it), and other habits
// of the files.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace topple {
namespace {

namespace fs = std::filesystem;
using Graph = std::map<std::string, std::set<std::string>>;

const fs::path root = TOPPLE_SOURCE_DIR;

std::string text_of(const fs::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

std::vector<fs::path> sources_below(const fs::path& folder) {
  std::vector<fs::path> found;
  if (!fs::exists(folder)) return found;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".h" || entry.path().extension() == ".cpp") found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

struct Include {
  std::string name;
  bool quoted = false;
};

std::vector<Include> includes_of(const std::string& text) {
  static const std::regex line(R"(^[ \t]*#[ \t]*include[ \t]*([<"])([^>"]+)[>"])", std::regex::multiline);
  std::vector<Include> found;
  for (std::sregex_iterator i(text.begin(), text.end(), line), end; i != end; ++i)
    found.push_back({(*i)[2], (*i)[1] == "\""});
  return found;
}

std::set<std::string> matches_of(const std::string& text, const std::regex& what) {
  std::set<std::string> found;
  for (std::sregex_iterator i(text.begin(), text.end(), what), end; i != end; ++i) found.insert((*i)[1]);
  return found;
}

/// Codes of complaints that a source gives, "E203" in quotes.
std::set<std::string> codes_given_in(const std::string& source) {
  static const std::regex code(R"re("([EW][0-9]{3})")re");
  return matches_of(source, code);
}

/// Codes of complaints that have a row in a table of a page.
std::set<std::string> codes_explained_in(const std::string& page) {
  static const std::regex row(R"(^\| ([EW][0-9]{3}) \|)", std::regex::multiline);
  return matches_of(page, row);
}

/// Lines "module: others...".
Graph parse_layers(const std::string& text) {
  Graph layers;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    const auto colon = line.find(':');
    if (colon == std::string::npos) continue;
    const auto others = words_of(line.substr(colon + 1));
    layers[line.substr(0, colon)] = {others.begin(), others.end()};
  }
  return layers;
}

/// Lines "topple_module(name DEPENDS others...)"; libraries from elsewhere have "::" in their names.
Graph parse_modules(const std::string& text) {
  static const std::regex call(R"(topple_module\(([^)]*)\))");
  Graph modules;
  for (std::sregex_iterator i(text.begin(), text.end(), call), end; i != end; ++i) {
    const auto words = words_of((*i)[1]);
    auto& depends = modules[words.at(0)];
    for (std::size_t k = 2; k < words.size(); ++k)
      if (words[k].find("::") == std::string::npos) depends.insert(words[k]);
  }
  return modules;
}

/// A module that reaches itself, or an empty name.
std::string find_cycle(const Graph& graph) {
  for (const auto& [start, unused] : graph) {
    std::set<std::string> seen;
    std::vector<std::string> open = {start};
    while (!open.empty()) {
      const auto at = graph.find(open.back());
      open.pop_back();
      if (at == graph.end()) continue;
      for (const auto& next : at->second) {
        if (next == start) return start;
        if (seen.insert(next).second) open.push_back(next);
      }
    }
  }
  return {};
}

/// What is wrong with the includes of one file of a module, one line each.
std::vector<std::string> find_faults(const std::string& module, const std::string& text, const Graph& layers) {
  std::vector<std::string> faults;
  for (const auto& [name, quoted] : includes_of(text)) {
    const std::string folder = name.substr(0, name.find('/'));
    const bool ours = layers.contains(folder) && name.find('/') != std::string::npos;
    if (folder == "apps" || folder == "tests" || name.find("..") != std::string::npos)
      faults.push_back("includes " + name + ", which lies above the modules");
    else if (quoted && !ours)
      faults.push_back("includes \"" + name + "\": write \"module/file.h\" for ours and <...> for others");
    else if (!quoted && ours && fs::exists(root / "src" / name))
      faults.push_back("includes <" + name + ">: write \"" + name + "\"");
    else if (quoted && folder != module && !layers.at(module).contains(folder))
      faults.push_back("includes " + name + ", but cmake/layers.txt does not let " + module + " see " + folder);
  }
  return faults;
}

TEST(Layers, EveryIncludeIsAllowed) {
  const Graph layers = parse_layers(text_of(root / "cmake/layers.txt"));
  ASSERT_TRUE(layers.contains("base"));
  std::size_t files = 0;
  for (const auto& path : sources_below(root / "src")) {
    const fs::path relative = fs::relative(path, root / "src");
    const std::string module = relative.begin()->string();
    if (!layers.contains(module)) {
      ADD_FAILURE() << relative << ": the module has no line in cmake/layers.txt";
      continue;
    }
    ++files;
    for (const auto& fault : find_faults(module, text_of(path), layers)) ADD_FAILURE() << relative << " " << fault;
  }
  EXPECT_GT(files, 10u) << "the sources were not found";
}

TEST(Layers, TheBuildLinksWhatTheLayersAllow) {
  const Graph layers = parse_layers(text_of(root / "cmake/layers.txt"));
  const Graph modules = parse_modules(text_of(root / "src/CMakeLists.txt"));
  ASSERT_FALSE(modules.empty());
  for (const auto& [module, depends] : modules) {
    ASSERT_TRUE(layers.contains(module)) << module << " has no line in cmake/layers.txt";
    std::set<std::string> allowed;
    for (const auto& other : layers.at(module))
      if (modules.contains(other)) allowed.insert(other);
    EXPECT_EQ(depends, allowed) << "DEPENDS of " << module << " in src/CMakeLists.txt against cmake/layers.txt";
  }
}

TEST(Layers, HaveNoCycle) { EXPECT_EQ(find_cycle(parse_layers(text_of(root / "cmake/layers.txt"))), ""); }

TEST(Layers, NothingIncludesAnApp) {
  for (const auto* folder : {"src", "tests", "bench"})
    for (const auto& path : sources_below(root / folder))
      for (const auto& include : includes_of(text_of(path)))
        EXPECT_FALSE(include.name.starts_with("apps/")) << path << " includes " << include.name;
}

TEST(Layers, OneFileSeesTheHdf5Library) {
  for (const auto& path : sources_below(root / "src"))
    for (const auto& include : includes_of(text_of(path)))
      if (include.name == "hdf5.h") { EXPECT_EQ(fs::relative(path, root), "src/record/hdf5.cpp"); }
}

// The rules must be able to fail.
TEST(LayersOnSamples, FindWhatIsForbidden) {
  const Graph layers = parse_layers("# rules\nbase:\nmbs: base\ncollapse: base mbs\n");
  EXPECT_EQ(find_faults("collapse", "#include <vector>\n#include \"mbs/model.h\"\n", layers).size(), 0u);
  EXPECT_EQ(find_faults("mbs", "#include \"collapse/run.h\"\n", layers).size(), 1u);
  EXPECT_EQ(find_faults("base", "  #  include \"mbs/model.h\"\n", layers).size(), 1u);
  EXPECT_EQ(find_faults("mbs", "#include \"model.h\"\n", layers).size(), 1u);
  EXPECT_EQ(find_faults("mbs", "#include \"../apps/main.h\"\n", layers).size(), 1u);
  EXPECT_EQ(find_faults("mbs", "#include <base/linalg.h>\n", layers).size(), 1u);
  EXPECT_EQ(find_faults("mbs", "#include \"mbs/model.h\"\n", layers).size(), 0u) << "its own header";
}

TEST(LayersOnSamples, FindCycles) {
  EXPECT_EQ(find_cycle(parse_layers("a: b\nb: c\nc:\n")), "");
  EXPECT_EQ(find_cycle(parse_layers("a: b\nb: c\nc: a\n")), "a");
  EXPECT_EQ(find_cycle(parse_layers("a: a\n")), "a");
}

TEST(LayersOnSamples, ReadTheBuild) {
  const Graph modules =
      parse_modules("# x\ntopple_module(base DEPENDS fmt::fmt)\ntopple_module(mbs DEPENDS base\n  A::b)");
  EXPECT_EQ(modules, (Graph{{"base", {}}, {"mbs", {"base"}}}));
}

TEST(Sources, StayBelowTwelveHundredLines) {
  for (const auto* folder : {"src", "apps", "tests", "bench"})
    for (const auto& path : sources_below(root / folder)) {
      const std::string text = text_of(path);
      EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 1200) << path;
    }
}

TEST(Sources, HeadersAreGuardedByPragmaOnce) {
  for (const auto* folder : {"src", "apps", "tests", "bench"})
    for (const auto& path : sources_below(root / folder))
      if (path.extension() == ".h") { EXPECT_TRUE(text_of(path).starts_with("#pragma once\n")) << path; }
}

TEST(Documents, LinkToWhatIsThere) {
  static const std::regex link(R"(\]\(([^)#:]+)(#[^)]*)?\))");
  std::vector<fs::path> pages = {root / "README.md", root / "CONTRIBUTING.md", root / "CHANGELOG.md"};
  for (const auto& entry : fs::recursive_directory_iterator(root / "docs"))
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  for (const auto& page : pages) {
    const std::string text = text_of(page);
    EXPECT_FALSE(text.empty()) << page;
    for (std::sregex_iterator i(text.begin(), text.end(), link), end; i != end; ++i) {
      EXPECT_TRUE(fs::exists(page.parent_path() / (*i)[1].str())) << page << " links to " << (*i)[1];
    }
  }
}

TEST(Documents, ExplainEveryCodeOfAComplaint) {
  std::set<std::string> given, explained;
  for (const auto* folder : {"src", "apps"})
    for (const auto& path : sources_below(root / folder)) given.merge(codes_given_in(text_of(path)));
  for (const auto& entry : fs::directory_iterator(root / "docs"))
    if (entry.path().extension() == ".md") explained.merge(codes_explained_in(text_of(entry.path())));
  ASSERT_TRUE(given.contains("E101"));
  for (const auto& code : given) EXPECT_TRUE(explained.contains(code)) << code << " has no row in docs/errors.md";
  for (const auto& code : explained) EXPECT_TRUE(given.contains(code)) << code << " is explained, but never given";
}

TEST(DocumentsOnSamples, FindCodes) {
  EXPECT_EQ(codes_given_in("throw InputError(\"E673\", x);  // E674\n{\"W501\"}"),
            (std::set<std::string>{"E673", "W501"}));
  EXPECT_EQ(codes_explained_in("E670 to E672\n\n| E673 | nothing |\n| W501 | it |\n| x | E999 |\n"),
            (std::set<std::string>{"E673", "W501"}));
}

}  // namespace
}  // namespace topple
