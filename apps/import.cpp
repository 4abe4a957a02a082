#include "product/import.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>

#include "base/file.h"
#include "commands.h"
#include "product/foreign_text.h"
#include "results.h"

namespace topple::apps {

namespace {

void print_list(std::FILE* out, const char* heading, const std::vector<std::string>& list) {
  if (list.empty()) return;
  std::fprintf(out, "\n%s\n", heading);
  for (const std::string& s : list) std::fprintf(out, "  %s\n", s.c_str());
}

}  // namespace

int import_file(const Arguments& a) {
  namespace fs = std::filesystem;
  std::string text;
  try {
    const fs::path path(a.input);
    std::string kind = path.extension().string();
    std::transform(kind.begin(), kind.end(), kind.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (kind != ".ifc" && kind != ".dxf")
      throw InputError("E114", a.input + " is neither .ifc nor .dxf", "give a building (IFC) or a site (DXF)");
    if (fs::exists(a.output))
      throw InputError("E802", a.output + " exists already and is left as it is", "choose another name");
    if (kind == ".ifc" && !a.unit.empty())
      throw InputError("E801", "--unit: is for drawings; an IFC file names its own", "leave it out");
    text = read_file(a.input);
    if (kind == ".dxf") text = product::to_line_feeds(std::move(text));  // for complaints to show their line
    const std::string name = path.filename().string();
    const double unit = read_quantity(a.unit, Dimension::Length, "--unit");
    const product::Import made = kind == ".ifc" ? product::make_plan_text(product::read_ifc(text, a.input), name)
                                                : product::make_site_text(text, a.input, unit);
    replace_file(a.output, made.text);
    std::FILE* out = a.json ? stderr : stdout;
    std::fprintf(out, "Wrote %s\n", a.output.c_str());
    print_list(out, "Taken", made.report.taken);
    print_list(out, "Guessed; look at it", made.report.guessed);
    print_list(out, "Missing", made.report.missing);
    int gaps = -1;  // the first line has one too
    for (size_t at = 0; (at = made.text.find("\"?\"", at)) != std::string::npos; ++at) ++gaps;
    std::fprintf(out, "\n%s marked \"?\"; topple check names them.\n",
                 gaps == 1 ? "1 gap is" : fmt::format("{} gaps are", gaps).c_str());
    if (a.json)
      std::printf("%s\n", dump(nlohmann::ordered_json{{"exit_code", kOk},
                                                      {"taken", made.report.taken},
                                                      {"guessed", made.report.guessed},
                                                      {"missing", made.report.missing},
                                                      {"gaps", gaps},
                                                      {"files", {{"plan", a.output}}}})
                              .c_str());
    return kOk;
  } catch (const InputError& e) { return refuse(e, {}, text, a.json); }
}

}  // namespace topple::apps
