#include "record/export.h"

#include <cstdio>
#include <filesystem>
#include <utility>

#include "base/file.h"
#include "collapse/debris_tables.h"
#include "commands.h"
#include "engines/adams.h"
#include "farfield/lsdyna.h"
#include "mbs/model_json.h"
#include "product/plan.h"
#include "results.h"

namespace topple::apps {

namespace {

int export_adams(const Arguments& a) {
  const std::string text = read_file(a.input);
  try {
    if (text.starts_with("\x89HDF"))
      throw InputError("E611", a.input + " is a record",
                       "--adams wants the model.json that topple run writes beside it");
    mbs::RunSettings settings;
    const mbs::Model model = mbs::model_from_json(text, a.input, &settings);
    const engines::AdamsFiles files =
        engines::to_adams(model, settings, std::filesystem::path(a.output).stem().string());
    const std::string commands = std::filesystem::path(a.output).replace_extension(".acf").string();
    for (const std::string& path : {a.output, commands}) check_own_input(path, a.input);
    if (std::filesystem::path(a.output).extension() != ".adm")
      throw InputError("E801", a.output + ": the commands beside the dataset, in the .acf, name it as an .adm",
                       "give -o a name that ends in .adm");
    replace_file(a.output, files.dataset);
    replace_file(commands, files.commands);
    std::printf("Wrote %s\nWrote %s\n", a.output.c_str(), commands.c_str());
    for (const std::string& note : files.notes) std::printf("note: %s\n", note.c_str());
    return kOk;
  } catch (const InputError& e) { return refuse(e, {}, text, false); }
}

/// The finite elements of a plan.
int export_lsdyna(const Arguments& a) {
  std::vector<Diagnostic> warnings;
  std::string text;
  try {
    check_own_input(a.output, a.input);
    farfield::GridOptions grid;
    grid.size = read_quantity(a.fe.size, Dimension::Length, "--size");
    grid.least_across = a.fe.across;
    const double until = read_quantity(a.duration, Dimension::Time, "--until");
    const product::Plan plan = product::read_plan_file(a.input, warnings, text);
    print_diagnostics(warnings, text);
    collapse::ModelMap map;
    const collapse::Knowledge k = load_knowledge(a);
    const mbs::Model model = collapse::make_model(plan, k, map, a.threads);
    const farfield::Whole whole = farfield::make_whole(plan, k, grid, model, map);
    replace_file(a.output, farfield::to_lsdyna(plan, whole, map, until > 0 ? until : plan.analysis.duration,
                                               k.contact_body_friction));
    for (const std::string& line : farfield::describe(farfield::calc_mesh_report(plan, whole)))
      std::printf("%s\n", line.c_str());
    std::printf("Wrote %s\n", a.output.c_str());
    for (const std::string& note : whole.notes) std::printf("note: %s\n", note.c_str());
    return kOk;
  } catch (const InputError& e) { return refuse(e, warnings, text, false); }
}

}  // namespace

int export_file(const Arguments& a, const std::atomic<bool>& cancel) {
  if (a.adams) return export_adams(a);
  if (a.fe.lsdyna) return export_lsdyna(a);
  try {
    record::Record r = record::read_hdf5(a.input);
    if (!a.frame_rate.empty())
      r = record::keep_frames(r, 1 / read_quantity(a.frame_rate, Dimension::Frequency, "--frame-rate"));
    make_folder(a.output);
    const auto is_cancelled = [&cancel] { return cancel.load(std::memory_order_relaxed); };
    const auto end = [] {
      std::fprintf(stderr, "Cancelled.\n");
      return kRunFailed;
    };
    if (is_cancelled()) return end();
    const auto say = [](const std::vector<std::string>& paths) {
      std::printf("Wrote %s", paths.front().c_str());
      if (paths.size() > 1) std::printf(" and %zu more", paths.size() - 1);
      std::printf("\n");
    };
    if (a.vtk) {
      const std::vector<std::string> paths = record::export_vtk(r, a.output, is_cancelled);
      if (paths.empty()) return end();
      say(paths);
    }
    if (a.gltf && is_cancelled()) return end();
    if (a.gltf) say(record::export_gltf(r, a.output));
    if (a.csv && is_cancelled()) return end();
    if (a.csv) {
      std::vector<std::string> paths = record::export_csv(r, a.output);
      constexpr double cell = 0.25;  // [m]
      const std::filesystem::path where(a.output);
      for (const auto& [name, table] : {std::pair("debris_heights.csv", collapse::make_height_table(r, cell)),
                                        std::pair("debris_outlines.csv", collapse::make_outline_table(r))}) {
        paths.push_back((where / name).string());
        replace_file(paths.back(), table);
      }
      say(paths);
    }
    if (a.json && is_cancelled()) return end();
    if (a.json) say(record::export_json(r, a.output));
    return kOk;
  } catch (const InputError& e) { return refuse(e, {}, {}, false); }
}

}  // namespace topple::apps
