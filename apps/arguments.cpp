#include "arguments.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <iostream>
#include <sstream>
#include <string_view>

#include "arguments_completion.h"
#include "arguments_manual.h"
#include "base/error.h"
#include "engines/engine.h"
#include "product/templates.h"
#include "program.h"
#include "refusal.h"

namespace topple::apps {

namespace {

void add_language(CLI::App* verb, Arguments& a) {
  verb->add_option("--language", a.language, "of the page: en (default) or de")->check(CLI::IsMember({"en", "de"}));
}

/// The answer for programs.
void add_json(CLI::App* verb, Arguments& a) {
  verb->add_flag("--json", a.json, "one JSON object on standard output, everything else on standard error");
}

/// 0x20 and 020 would count as what few expect.
std::string is_whole_number(const std::string& s) {
  const bool is_whole =
      !s.empty() && s.find_first_not_of("0123456789") == std::string::npos && (s == "0" || s[0] != '0');
  return is_whole ? std::string() : "a whole number is wanted, not \"" + s + "\"";
}

void add_threads(CLI::App* verb, Arguments& a) {
  verb->add_option("--threads", a.threads, "threads; results do not depend on it")
      ->check(is_whole_number)
      ->check(CLI::Range(1, 1024));
}

/// Name of a type whose values completion offers; what is not among them has an error of its own.
std::string choose_from(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "NAME:{" : ",") + name;
  return out + "}";
}
std::vector<std::string> names_of_templates() {
  std::vector<std::string> out;
  for (const product::Template& t : product::templates()) out.push_back(t.name);
  return out;
}

/// Of what runs a multibody model.
void add_run_options(CLI::App* verb, Arguments& a) {
  verb->add_option("-o,--output", a.output, "folder for the results; it is made if missing")
      ->type_name("FOLDER")
      ->required();
  verb->add_option("--duration", a.duration, "simulated time, such as \"10 s\"")->type_name("QUANTITY");
  verb->add_option("--step", a.step, "time step, such as \"0.1 ms\"; chosen from the stiffest element if not given")
      ->type_name("QUANTITY");
  verb->add_option("--step-share", a.step_share, "of that step, such as 0.5, to see what hangs on it")
      ->check(CLI::Range(0.001, 1.0))
      ->check(
          [](const std::string& word) { return word.find_first_of("nN") == std::string::npos ? "" : "is no number"; });
  add_threads(verb, a);
  verb->add_option("--engine", a.engine, "program that solves the multibody model")
      ->type_name(choose_from(engines::engine_names()));
  add_json(verb, a);
  verb->add_flag("--csv", a.csv, "also write tables for spreadsheets");
  add_language(verb, a);
  verb->add_flag("--verbose", a.verbose, "show every event");
  CLI::Option* none = verb->add_flag("--no-report", a.no_report, "do not write report.html");
  verb->add_flag("--report", a.report, "fail if report.html cannot be written")->excludes(none);
}

/// Of runs that can go on later.
void add_checkpoint_options(CLI::App* verb, Arguments& a) {
  verb->add_flag("--checkpoint", a.checkpoint, "keep checkpoint.bin in the folder, to go on from with --resume");
  verb->add_option("--checkpoint-interval", a.checkpoint_interval,
                   "of the clock (60 s), with --checkpoint or --resume, which keeps one too")
      ->type_name("QUANTITY");
  verb->add_flag("--resume", a.resume, "go on from checkpoint.bin in the folder");
}

/// Of what runs models for studies.
void add_worker_options(CLI::App* verb, StudyArguments& y) {
  verb->add_option_function<int>(
          "--jobs", [&y](int n) { y.jobs = n, y.is_jobs_given = true; },
          "runs at the same time here (default: as many as there are processors); 0: workers elsewhere do everything")
      ->check(is_whole_number)
      ->check(CLI::Range(0, 4096));
  verb->add_option("--batch", y.batch, "points that one evaluator gets at once (1)")
      ->check(is_whole_number)
      ->check(CLI::Range(1, 100000));
  verb->add_option("--lease", y.lease,
                   "time without a sign of life after which a run is given to another, as --timeout (30 s)")
      ->type_name("QUANTITY");
}

/// Examples in the help; each works in a folder where those of the verbs above it were run (tests/apps/cli_test.sh).
void add_examples(CLI::App* verb, const std::string& lines) { verb->footer("Examples:\n" + lines); }

void add_new(CLI::App& app, Arguments& a) {
  CLI::App* verb_new = app.add_subcommand("new", "Write a commented plan to begin with.");
  CLI::Option* new_file =
      verb_new->add_option("file", a.input, "file to write; an existing one is left alone")->type_name("FILE");
  verb_new->add_option("-o,--output", a.input, "the same")->type_name("FILE")->excludes(new_file);
  verb_new->add_option("--template", a.plan_template, "kind of structure, as --list shows them (frame)")
      ->type_name(choose_from(names_of_templates()));
  verb_new->add_flag("--list", a.list, "show the templates");
  add_json(verb_new, a);
  verb_new->callback([&a] { a.verb = Arguments::Verb::New; });
  add_examples(verb_new, R"(  topple new plan.toml
  topple new --list)");
}

void add_check(CLI::App& app, Arguments& a) {
  CLI::App* check = app.add_subcommand("check", "Report everything that is wrong with a plan.");
  check->add_option("plan", a.input, "plan (TOML)")->type_name("FILE")->required();
  check->add_option("--knowledge", a.knowledge, "file of knowledge rules instead of the built-in ones")
      ->type_name("FILE");
  check->add_flag("--json", a.json, "one JSON object on standard output");
  check->callback([&a] { a.verb = Arguments::Verb::Check; });
  add_examples(check, R"(  topple check plan.toml
  topple check plan.toml --json            complaints for programs)");
}

void add_run(CLI::App& app, Arguments& a) {
  CLI::App* run = app.add_subcommand("run", "Simulate a plan.");
  run->add_option("plan", a.input, "plan (TOML)")->type_name("FILE")->required();
  run->add_option("--knowledge", a.knowledge, "file of knowledge rules instead of the built-in ones")
      ->type_name("FILE");
  run->add_flag("--check-step", a.check_step,
                "run also at half the step and say what differs; with --threads 2 both at once");
  add_run_options(run, a);
  add_checkpoint_options(run, a);
  run->callback([&a] { a.verb = Arguments::Verb::Run; });
  add_examples(run, R"(  topple run plan.toml -o out              findings, out/record.h5, out/report.html
  topple run plan.toml -o out --csv        also tables for spreadsheets
  topple run plan.toml -o out --check-step --threads 2
                                           and what half the time step makes of it
  topple run plan.toml -o half --duration "1 s" --no-report
  topple run plan.toml -o out --checkpoint
                                           and, after an interruption, with --resume)");
}

void add_rules(CLI::App& app, Arguments& a) {
  CLI::App* rules = app.add_subcommand("rules", "Show the knowledge rules of the simulation manager.");
  rules->add_flag("--json", a.json, "as a file that --knowledge reads");
  rules->callback([&a] { a.verb = Arguments::Verb::Rules; });
  add_examples(rules, R"(  topple rules                             with their reasons
  topple rules --json > rules.json         to change one and run with --knowledge)");
}

void add_mbs_run(CLI::App& mbs, Arguments& a) {
  CLI::App* mbs_run = mbs.add_subcommand("run", "Run a multibody model on its own.");
  mbs_run->add_option("model", a.input, "multibody model (JSON)")->type_name("FILE")->required();
  mbs_run->add_option("--frame-rate", a.frame_rate, "poses kept, such as \"60 Hz\"")->type_name("QUANTITY");
  CLI::Option* with = mbs_run->add_flag_callback(
      "--equilibrium", [&a] { a.equilibrium = true; },
      "begin with the equilibrium under dead load, whatever the file says");
  mbs_run
      ->add_flag_callback(
          "--no-equilibrium", [&a] { a.equilibrium = false; }, "begin with the poses and velocities of the file")
      ->excludes(with);
  add_run_options(mbs_run, a);
  add_checkpoint_options(mbs_run, a);
  mbs_run->callback([&a] { a.verb = Arguments::Verb::MbsRun; });
  add_examples(mbs_run, R"(  topple mbs run out/model.json -o again --duration "1 s"
  topple mbs run out/model.json -o again --checkpoint --duration "1 s"
                                           and, after an interruption, with --resume)");
}

void add_mbs_compare(CLI::App& mbs, Arguments& a) {
  CLI::App* mbs_compare = mbs.add_subcommand("compare", "Run a multibody model on several engines and compare.");
  mbs_compare->add_option("model", a.input, "multibody model (JSON)")->type_name("FILE")->required();
  mbs_compare
      ->add_option("--engines", a.engines, "names between commas, such as native,simbody,mujoco; all if left out")
      ->check([](const std::string& s) {
        return s.find_first_not_of(" \t,") == std::string::npos ? std::string("names no engine") : std::string();
      });
  mbs_compare->add_option("-o,--output", a.output, "folder for compare.csv and compare.svg")->type_name("FOLDER");
  mbs_compare->add_option("--duration", a.duration, "simulated time, such as \"10 s\"")->type_name("QUANTITY");
  mbs_compare->add_option("--step", a.step, "fixed step of all engines, such as \"0.1 ms\"")->type_name("QUANTITY");
  mbs_compare->add_option(
      "--accuracy", a.accuracy,
      "relative, of engines that control their errors and then choose their steps, --step or not; 1e-9 without --step");
  mbs_compare->add_option("--frames", a.frames, "instants that are compared (100)")
      ->check(is_whole_number)
      ->check(CLI::Range(1, 1000000));
  mbs_compare->add_flag("--bodies", a.bodies, "also list every body");
  mbs_compare->add_flag("--skip-unsupported", a.skip_unsupported,
                        "go on without engines that cannot express the model");
  mbs_compare->add_flag("--json", a.json, "one JSON object on standard output");
  mbs_compare->callback([&a] { a.verb = Arguments::Verb::MbsCompare; });
  add_examples(mbs_compare, R"(  topple mbs compare out/model.json --engines native --duration "0.2 s"
  topple mbs compare model.json --engines native,simbody,mujoco -o engines)");
}

void add_mbs_verify(CLI::App& mbs, Arguments& a) {
  CLI::App* mbs_verify = mbs.add_subcommand("verify", "Check an engine against models whose answers are known.");
  mbs_verify->add_option("--engine", a.engine, "program that solves the multibody models")
      ->type_name(choose_from(engines::engine_names()));
  mbs_verify->add_option("--markdown", a.markdown, "page to write (docs/verification.md is one)")->type_name("FILE");
  mbs_verify->add_option("--json", a.json_file, "the same for programs: file to write")->type_name("FILE");
  mbs_verify->callback([&a] { a.verb = Arguments::Verb::MbsVerify; });
  add_examples(mbs_verify, R"(  topple mbs verify
  topple mbs verify --engine simbody --markdown simbody.md)");
}

void add_mbs(CLI::App& app, Arguments& a) {
  CLI::App* mbs = app.add_subcommand("mbs", "Work with multibody models.");
  mbs->require_subcommand(1);
  add_mbs_run(*mbs, a);
  add_mbs_compare(*mbs, a);
  add_mbs_verify(*mbs, a);
  add_examples(mbs, R"(  topple mbs run out/model.json -o again --duration "1 s"
  topple mbs verify)");
}

void add_report(CLI::App& app, Arguments& a) {
  CLI::App* report = app.add_subcommand("report", "Make the self-contained page from a record.");
  report->add_option("record", a.input, "record (HDF5)")->type_name("FILE")->required();
  report->add_option("-o,--output", a.output, "page to write")->type_name("FILE")->required();
  report->add_option("--study", a.study_results, "also tell what a fuzzy study found: its folder or its results.json")
      ->type_name("PATH");
  report->add_option("--compare", a.other_records, "also tell how other records differ, say one of topple fe")
      ->type_name("FILE");
  add_language(report, a);
  add_json(report, a);
  report->callback([&a] { a.verb = Arguments::Verb::Report; });
  add_examples(report, R"(  topple report out/record.h5 -o report.html
  topple report out/record.h5 -o bericht.html --language de
  topple report out/record.h5 -o report.html --study study --compare fe/record.h5)");
}

void add_export(CLI::App& app, Arguments& a) {
  CLI::App* exports =
      app.add_subcommand("export", "Write a record, or a multibody model, for other programs (docs/exports.md).");
  exports->add_option("file", a.input, "record (HDF5); with --adams a multibody model (JSON), with --lsdyna a plan")
      ->type_name("FILE")
      ->required();
  exports->add_option("-o,--output", a.output, "folder for the files; with --adams and --lsdyna the file to write")
      ->type_name("FOLDER")
      ->required();
  CLI::Option* vtk = exports->add_flag("--vtk", a.vtk, "record.pvd and vtk/*.vtu, for ParaView");
  CLI::Option* gltf = exports->add_flag("--gltf", a.gltf, "record.glb with animation, for Blender and browsers");
  CLI::Option* csv = exports->add_flag("--csv", a.csv, "tables for spreadsheets");
  CLI::Option* as_json = exports->add_flag("--json", a.json, "record.json, for scripts");
  CLI::Option* rate =
      exports->add_option("--frame-rate", a.frame_rate, "frames kept, such as \"10 Hz\"; all if left out")
          ->type_name("QUANTITY");
  CLI::Option* adams = exports->add_flag("--adams", a.adams, "dataset for MSC.ADAMS, and its commands (.acf)");
  CLI::Option* lsdyna = exports->add_flag("--lsdyna", a.fe.lsdyna,
                                          "keyword file (.k) of a plan's finite elements, for LS-DYNA and OpenRadioss");
  exports->add_option("--size", a.fe.size, "edge of the elements of --lsdyna (0.4 m)")
      ->type_name("QUANTITY")
      ->needs(lsdyna);
  exports->add_option("--across", a.fe.across, "of these over the thickness of columns and beams, at least (2)")
      ->check(is_whole_number)
      ->check(CLI::Range(2, 8))
      ->needs(lsdyna);
  exports->add_option("--until", a.duration, "time that --lsdyna asks for; the plan's duration if not given")
      ->type_name("QUANTITY")
      ->needs(lsdyna);
  lsdyna->excludes(adams);
  for (CLI::Option* other : {vtk, gltf, csv, as_json, rate}) adams->excludes(other), lsdyna->excludes(other);
  exports->callback([&a] { a.verb = Arguments::Verb::Export; });
  add_examples(exports, R"(  topple export out/record.h5 --csv -o tables
  topple export out/record.h5 --vtk --frame-rate "10 Hz" -o vtk
  topple export out/record.h5 --gltf -o scene
  topple export out/model.json --adams -o model.adm)");
}

void add_import(CLI::App& app, Arguments& a) {
  CLI::App* import = app.add_subcommand(
      "import", "Make a plan with marked gaps from an IFC file, or a site from a DXF drawing (docs/imports.md).");
  import->add_option("file", a.input, "building (.ifc) or site (.dxf)")->type_name("FILE")->required();
  import->add_option("-o,--output", a.output, "plan to write; an existing one is left alone")
      ->type_name("FILE")
      ->required();
  import->add_option("--unit", a.unit, "of a drawing's numbers, such as \"1 mm\", whatever its header says")
      ->type_name("QUANTITY");
  add_json(import, a);
  import->callback([&a] { a.verb = Arguments::Verb::Import;
});
add_examples(import, R"(  topple import building.ifc -o building.toml
  topple import site.dxf -o site.toml --unit "1 mm")");
}  // namespace

void add_rcc(CLI::App& app, Arguments& a) {
  CLI::App* rcc = app.add_subcommand("rcc", "Compute the resistance curves of a zone of a section, or of a member.");
  rcc->add_option("file", a.input, "section (TOML), or a plan with --member")->type_name("FILE")->required();
  rcc->add_option("-o,--output", a.output, "folder for curves, page and pictures; it is made if missing")
      ->type_name("FOLDER");
  rcc->add_option("--normal-force", a.normal_forces,
                  "such as \"3.7 MN\", compression positive; may be given more than once")
      ->type_name("QUANTITY")
      ->type_size(1)
      ->allow_extra_args(false);
  CLI::Option* member = rcc->add_option("--member", a.member, "column or beam of the plan, such as C-D1-0");
  rcc->add_option("--zone", a.zone, "end of the member: foot (start) or top (end)")
      ->check(CLI::IsMember({"foot", "top", "start", "end"}))
      ->needs(member);
  CLI::Option* fuzzy =
      rcc->add_option("--fuzzy", a.fuzzy, "file of fuzzy inputs (TOML): also fuzzy curves")->type_name("FILE");
  fuzzy->excludes(member);
  rcc->add_option("--route", a.route, "layered (default), solid (finite elements, minutes), or both")
      ->check(CLI::IsMember({"layered", "solid", "both"}));
  rcc->add_option("--axis", a.axis, "of fuzzy curves and of the solid route: y (default) or z")
      ->check(CLI::IsMember({"y", "z"}));
  rcc->add_option("--direction", a.direction, "of fuzzy curves and of the solid route: + (default) or -")
      ->check(CLI::IsMember({"+", "-"}));
  rcc->add_option("--rotation", a.rotation, "largest rotation of the solid route, such as \"0.02 rad\"")
      ->type_name("QUANTITY");
  rcc->add_option("--element-size", a.element_size, "largest edge of an element of the solid route, such as \"5 cm\"")
      ->type_name("QUANTITY");
  rcc->add_option("--knowledge", a.knowledge, "file of knowledge rules instead of the built-in ones")
      ->type_name("FILE");
  add_threads(rcc, a);
  add_json(rcc, a);
  rcc->callback([&a] { a.verb = Arguments::Verb::Rcc; });
  add_examples(rcc, R"(  topple rcc plan.toml --member C-A1-0 -o zone
  topple rcc plan.toml --member C-A1-0 --zone top --normal-force "300 kN"
  topple rcc section.toml --fuzzy fuzzy.toml -o curves)");
}

void add_fe(CLI::App& app, Arguments& a) {
  FeArguments& f = a.fe;
  CLI::App* fe = app.add_subcommand("fe", "Simulate a plan with explicit finite elements, as a second opinion.");
  fe->add_option("plan", a.input, "plan (TOML)")->type_name("FILE")->required();
  fe->add_option("-o,--output", a.output, "folder for the results; it is made if missing")->type_name("FOLDER");
  fe->add_option("--size", f.size, "edge of the elements (0.4 m); smaller ones cost more and shorten the step")
      ->type_name("QUANTITY");
  fe->add_option("--across", f.across, "elements over the thickness of columns and beams, at least (2)")
      ->check(is_whole_number)
      ->check(CLI::Range(2, 8));
  fe->add_flag("--mesh-only", f.mesh_only, "only make the mesh and say what it is like");
  fe->add_option("--scaled-step", f.scaled_step,
                 "give mass to elements that do not bear this step, such as \"0.02 ms\"")
      ->type_name("QUANTITY");
  fe->add_flag("--skip-quiet", f.skip_quiet, "do not wait through the time in which nothing moves before a charge");
  fe->add_option("--until", a.duration, "simulated time, such as \"6 s\"; the plan's duration if not given")
      ->type_name("QUANTITY");
  add_checkpoint_options(fe, a);
  add_threads(fe, a);
  fe->add_option("--knowledge", a.knowledge, "file of knowledge rules instead of the built-in ones")->type_name("FILE");
  add_json(fe, a);
  add_language(fe, a);
  fe->add_flag("--csv", a.csv, "also write tables for spreadsheets");
  fe->add_flag("--verbose", a.verbose, "show every event");
  fe->add_flag("--no-report", a.no_report, "do not write report.html");
  fe->callback([&a] { a.verb = Arguments::Verb::Fe; });
  add_examples(fe, R"(  topple fe plan.toml --mesh-only          what the mesh is like
  topple fe plan.toml --size "0.4 m" -o fe
  topple fe plan.toml --resume -o fe       go on after an interruption with --checkpoint)");
}

void add_compare(CLI::App& app, Arguments& a) {
  CLI::App* compare = app.add_subcommand("compare", "Compare two runs of one building: text, CSV, JSON and a page.");
  compare->add_option("first", a.input, "record A (HDF5)")->type_name("FILE")->required();
  compare->add_option("second", a.fe.second, "record B")->type_name("FILE")->required();
  compare->add_option("-o,--output", a.output, "folder for compare.txt, .csv, .json and .html; it is made if missing")
      ->type_name("FOLDER")
      ->required();
  compare->add_option("--photos", a.fe.photos, "table \"time,file\" of photographs of the real event [s]")
      ->type_name("FILE");
  compare->add_flag("--json", a.json, "print compare.json instead of the text");
  compare->callback([&a] { a.verb = Arguments::Verb::Compare; });
  add_examples(compare, R"(  topple compare out/record.h5 half/record.h5 -o both)");
}

void add_steer(CLI::App& app, Arguments& a) {
  CLI::App* steer = app.add_subcommand("steer", "Watch a plan come down, stop it, change it, go on.");
  steer->add_option("plan", a.input, "plan (TOML); without one the page begins with templates")->type_name("FILE");
  steer->add_option("-o,--output", a.output, "folder of action logs and studies (steer)")->type_name("FOLDER");
  steer->add_option("--port", a.port, "port of 127.0.0.1; a free one if not given");
  steer->add_flag("--no-open", a.no_open, "only print the address");
  steer->add_flag("--continue", a.goes_on, "go on with the latest session of this plan, from its action log");
  steer->add_option("--knowledge", a.knowledge, "file of knowledge rules instead of the built-in ones")
      ->type_name("FILE");
  add_threads(steer, a);
  steer->add_flag("--json", a.json, "the address in one line of JSON on standard output");
  steer->callback([&a] { a.verb = Arguments::Verb::Steer; });
  add_examples(steer, R"(  topple steer plan.toml                   opens the page
  topple steer plan.toml --no-open --port 8080)");
}

void add_replay(CLI::App& app, Arguments& a) {
  CLI::App* replay = app.add_subcommand("replay", "Do again what an action log of topple steer says.");
  replay->add_option("log", a.input, "action log (JSON lines)")->type_name("FILE")->required();
  replay->add_option("-o,--output", a.output, "folder for the records of the branches")
      ->type_name("FOLDER")
      ->required();
  replay->add_option("--knowledge", a.knowledge, "file of knowledge rules instead of the built-in ones")
      ->type_name("FILE");
  add_threads(replay, a);
  add_json(replay, a);
  replay->add_flag("--csv", a.csv, "also write tables for spreadsheets");
  replay->add_flag("--no-report", a.no_report, "do not write report.html");
  replay->callback([&a] { a.verb = Arguments::Verb::Replay; });
  add_examples(replay, R"(  topple replay steer/plan.steer.jsonl -o again)");
}

/// Refuses a value of blanks alone.
auto is_given(const char* what) {
  return [what](const std::string& s) {
    return s.find_first_not_of(" \t\r\n") == std::string::npos ? std::string(what) + " is wanted" : std::string();
  };
}

void add_study(CLI::App& app, Arguments& a) {
  StudyArguments& y = a.study;
  CLI::App* study = app.add_subcommand("study", "Fuzzy analysis: many runs, and what follows from them.");
  study->add_option("file", a.input, "plan with [fuzzy], or fuzzy inputs of an evaluator (TOML)")->type_name("FILE");
  study->add_option("-o,--output", a.output, "folder of the study; the same command again goes on with it")
      ->type_name("FOLDER");
  study
      ->add_option("--evaluator", y.evaluator,
                   "command that is the model: reads points and writes answers as JSON lines (docs/study.md)")
      ->check(is_given("a command"));
  study->add_option("--alpha", y.alpha, "levels between commas, such as 0,0.25,0.5,0.75,1")->check(is_given("a level"));
  study->add_option("--samples", y.samples, "runs at most")->check(is_whole_number)->check(CLI::Range(10, 100000000));
  study->add_option("--seed", y.seed, "of spread points and searches")->check([](const std::string& s) {
    if (std::string problem = is_whole_number(s); !problem.empty()) return problem;
    long long number = 0;
    const bool is_small = std::from_chars(s.data(), s.data() + s.size(), number).ec == std::errc();
    return is_small ? std::string() : "a number below 2^63 is wanted, not " + s;
  });
  study
      ->add_option("--permissible", y.permissible,
                   "look for boxes of inputs that keep this, such as \"topple, reach_pos_x <= 20\"")
      ->check(is_given("a requirement"));
  study->add_flag("--no-drivers", y.no_drivers, "spend no runs on which input drives what");
  study->add_option("--timeout", y.timeout, "time for one answer, such as \"60 s\" or 60 (seconds); none if left out")
      ->type_name("QUANTITY");
  study->add_flag("--one-shot", y.one_shot, "start the command for every point and close its input behind it");
  study->add_option("--store", y.store, "database on a server, postgresql://user@host/name; a file if left out")
      ->check(is_given("an address"));
  study->add_option("--name", y.name, "of the study on the server; that of the folder if left out")
      ->check(is_given("a name"));
  CLI::Option* condensed =
      study->add_flag("--condensed", y.condensed,
                      "of a plan: run its like frames as one, at a tenth of the cost; whole runs confirm the bounds");
  study->add_option("--confirm", y.confirm, "whole runs at the end of a condensed study at most")
      ->check(is_whole_number)
      ->check(CLI::Range(1, 1000000))
      ->needs(condensed);
  study->add_flag("--rerun-failed", y.rerun_failed, "run those again that failed");
  study->add_option("--knowledge", a.knowledge, "of a plan: file of knowledge rules instead of the built-in ones")
      ->type_name("FILE");
  add_json(study, a);
  add_worker_options(study, y);
  CLI::App* study_show = study->add_subcommand("show", "Show what a study has found so far.");
  CLI::App* study_export = study->add_subcommand("export", "Write what a study has found so far: page, CSV and JSON.");
  for (CLI::App* verb : {study_show, study_export})
    verb->add_option("folder", a.input, "folder of the study")->type_name("FOLDER")->required();
  add_language(study, a);
  add_language(study_export, a);
  study_show->add_flag("--json", a.json, "as a JSON object");
  add_json(study_export, a);
  study_export->add_option("-o,--output", a.output, "folder for the files; the study's own if left out")
      ->type_name("FOLDER");
  study->callback([&a] { a.verb = Arguments::Verb::Study; });
  add_examples(study, R"(  topple study plan-fuzzy.toml -o study --samples 300
  topple study inputs.toml --evaluator ./model -o study
  topple study show study)");
  study_show->callback([&y] { y.action = StudyArguments::Action::Show; });
  study_export->callback([&y] { y.action = StudyArguments::Action::Export; });
  add_examples(study_show, R"(  topple study show study)");
  add_examples(study_export, R"(  topple study export study -o tables)");
}

/// A quantity or a path that is given as "" is none; one that is not given has its default.
void refuse_empty_values(CLI::App& verb) {
  for (CLI::Option* option : verb.get_options())
    for (const auto& [type, what] :
         {std::pair("QUANTITY", "quantity"), {"FILE", "file"}, {"FOLDER", "folder"}, {"PATH", "path"}})
      if (option->get_type_name() == type)
        option->check([what = std::string(what)](const std::string& text) {
          return text.empty() ? "a " + what + " is wanted" : std::string();
        });
  for (CLI::App* below : verb.get_subcommands([](CLI::App*) { return true; })) refuse_empty_values(*below);
}

void add_worker(CLI::App& app, Arguments& a) {
  StudyArguments& y = a.study;
  CLI::App* worker = app.add_subcommand("worker", "Work for studies: take runs, do them, write their results.");
  worker->add_option("store", a.input, "folder of a study, or postgresql://user@host/name")
      ->type_name("FOLDER")
      ->required();
  worker->add_option("--idle", y.idle, "end after so long without work, such as \"10 min\"; else when no study is open")
      ->type_name("QUANTITY");
  worker->add_option("--name", y.name, "of the one study on the server to work for; those of all if left out")
      ->check(is_given("a name"));
  add_worker_options(worker, y);
  add_json(worker, a);
  worker->callback([&a] { a.verb = Arguments::Verb::Worker; });
  add_examples(worker, R"(  topple worker study --jobs 4
  topple worker postgresql://user@host/studies --idle "10 min")");
}

void add_demo(CLI::App& app, Arguments& a) {
  CLI::App* demo = app.add_subcommand("demo", "Bring down a storehouse that is built in, and show its report.");
  demo->add_option("-o,--output", a.output, "folder for the plan and the results (storehouse)")->type_name("FOLDER");
  add_language(demo, a);
  demo->add_flag("--open", a.open, "open the report in the desktop's browser");
  add_threads(demo, a);
  add_json(demo, a);
  demo->callback([&a] { a.verb = Arguments::Verb::Demo; });
  add_examples(demo, R"(  topple demo                              into the folder storehouse
  topple demo -o first --open              and open the report)");
}

void add_doctor(CLI::App& app, Arguments& a) {
  CLI::App* doctor = app.add_subcommand("doctor", "Show what is installed and check it against known numbers.");
  doctor->add_flag("--json", a.json, "one JSON object on standard output");
  doctor->callback([&a] { a.verb = Arguments::Verb::Doctor; });
  add_examples(doctor, R"(  topple doctor
  topple doctor --json)");
}

void add_version(CLI::App& app, Arguments& a) {
  CLI::App* version = app.add_subcommand("version", "Show the version.");
  add_json(version, a);
  version->callback([&a] { a.verb = Arguments::Verb::Version; });
  add_examples(version, R"(  topple version)");
}

/// What is missing and the parser cannot know of, as text to print; empty if nothing is.
std::string find_missing(const Arguments& a) {
  const auto refuse = [](const std::string& verb, const std::string& what) {
    return "topple " + verb + ": " + what + "\nRun topple " + verb + " --help for more information.\n";
  };
  // `other`: what does not go with checkpoints, where it is given
  const auto find_odd_checkpoint = [&](const std::string& verb, const std::string& other) {
    const bool is_kept = a.checkpoint || a.resume;
    if (is_kept && !other.empty())
      return refuse(verb, other + " excludes " + (a.checkpoint ? "--checkpoint" : "--resume"));
    return a.checkpoint_interval.empty() || is_kept
               ? std::string()
               : refuse(verb, "--checkpoint-interval requires --checkpoint or --resume");
  };
  const std::string other_engine = a.engine == "native" ? "" : "--engine " + a.engine;
  switch (a.verb) {
    case Arguments::Verb::New:
      return a.input.empty() && !a.list ? refuse("new", "a file to write is required") : "";
    case Arguments::Verb::Export:
      if (a.vtk || a.gltf || a.csv || a.json || a.adams || a.fe.lsdyna) return "";
      return refuse("export", "say what for: --vtk, --gltf, --csv, --json, --adams or --lsdyna");
    case Arguments::Verb::Fe:
      if (a.output.empty() && !a.fe.mesh_only) return refuse("fe", "--output is required");
      return find_odd_checkpoint("fe", a.fe.mesh_only ? "--mesh-only" : "");
    case Arguments::Verb::Run:
      return find_odd_checkpoint("run", a.check_step ? "--check-step" : other_engine);
    case Arguments::Verb::MbsRun:
      return find_odd_checkpoint("mbs run", other_engine);
    case Arguments::Verb::Study:
      if (a.study.action != StudyArguments::Action::Run || !(a.input.empty() || a.output.empty())) return "";
      return refuse("study",
                    (a.input.empty() ? "a plan or a file of fuzzy inputs" : "--output") + std::string(" is required"));
    default:
      return "";
  }
}

/// Of the first option that nobody knows, as text to print; empty if it was something else that was not expected.
std::string find_unknown(const CLI::App& app) {
  const CLI::App* verb = &app;
  std::string name = "topple";
  while (!verb->get_subcommands().empty()) {
    verb = verb->get_subcommands().front();
    name += " " + verb->get_name();
  }
  std::vector<std::string> known;
  for (const CLI::Option* option : verb->get_options())
    for (const std::string& word : option->get_lnames()) known.push_back("--" + word);
  for (const std::string& word : app.remaining(true)) {
    if (!word.starts_with('-')) continue;
    const std::string near = nearest_name(word.substr(0, word.find('=')), known);
    return fmt::format("{}: there is no option {}{}\nRun {} --help for its options.\n", name, word,
                       near.empty() ? "" : fmt::format("; did you mean {}?", near), name);
  }
  return "";
}

}  // namespace topple::apps

namespace {

/// Says what is wrong with the words of a command, with the JSON object if that was asked for.
int refuse_words(const CLI::App& app, int argc, char** argv, const std::string& text) {
  std::cerr << text;
  const CLI::App* verb = &app;
  while (!verb->get_subcommands().empty()) verb = verb->get_subcommands().front();
  const CLI::Option* flag = verb->get_option_no_throw("--json");
  const std::string name = verb->get_name();
  // of export and rules it is a format
  const bool as_json =
      flag != nullptr && flag->get_items_expected_max() == 0 && name != "export" && name != "rules" &&
      std::any_of(argv, argv + argc, [](const char* word) { return std::string_view(word) == "--json"; });
  if (!as_json) return kBadInput;
  const size_t end = text.find('\n');
  std::string help = end == std::string::npos ? "" : text.substr(end + 1);
  while (!help.empty() && help.back() == '\n') help.pop_back();
  print_refusal({{Severity::Error, "E801", {}, 1, text.substr(0, end), help}});
  return kBadInput;
}

}  // namespace

std::variant<Arguments, int> parse_arguments(int argc, char** argv) {
  Arguments a;
  // topple help run: topple run --help
  std::vector<char*> words(argv, argv + argc);
  char flag[] = "--help";
  if (argc > 1 && std::string_view(argv[1]) == "help") {
    words.erase(words.begin() + 1);
    words.push_back(flag);
    argv = words.data();
  }
  CLI::App app{"topple shows a demolition engineer how a building will come down.", "topple"};
  app.require_subcommand(1);
  app.set_version_flag("--version", "topple " + program_version());
  app.footer(R"(Examples:
  topple demo                                      see one building come down
  topple doctor                                    what is installed, and whether it calculates what is known
  topple new storehouse.toml                       write a commented plan to begin with
  topple check storehouse.toml                     report everything that is wrong with it
  topple run storehouse.toml -o out                simulate; findings, out/record.h5, out/report.html
  topple run storehouse.toml -o out --json         the same for programs (docs/run.md)
  topple mbs run out/model.json -o again           run a multibody model on its own
  topple mbs compare out/model.json                the same model on other engines (docs/engines.md)
  topple mbs verify                                the engine against known answers (docs/verification.md)
  topple report out/record.h5 -o report.html       make the page from a record
  topple import building.ifc -o plan.toml          a plan with its gaps marked "?" (docs/imports.md)
  topple export out/record.h5 --vtk -o out/vtk     for ParaView; --gltf, --csv, --json (docs/exports.md)
  topple export out/model.json --adams -o out/model.adm
                                                   for MSC.ADAMS
  topple rcc section.toml -o out/rcc               resistance curves of a zone of a section (docs/rcc.md)
  topple fe storehouse.toml --size "0.4 m" -o fe  the same building in finite elements (docs/fe.md)
  topple compare out/record.h5 fe/record.h5 -o both  two runs of one building beside each other (docs/compare.md)
  topple study plan.toml -o out/study              fuzzy analysis of a plan with [fuzzy] (docs/study.md)
  topple study inputs.toml --evaluator ./model -o out/study
                                                   the same of any program
  topple study show out/study                      what it found so far
  topple steer storehouse.toml                     watch it come down, stop, change, go on (docs/steer.md)
  topple replay steer/storehouse.steer.jsonl -o out/again
                                                   do what was done there once more

Exit codes: 0 done, 1 the run failed or was cancelled, 2 bad input, 3 a criterion of the plan is violated or not judged.)");

  for (const auto add : {add_new, add_check, add_run, add_rules, add_mbs, add_report, add_export, add_import, add_rcc,
                         add_fe, add_compare, add_steer, add_replay, add_study, add_worker, add_demo, add_doctor})
    add(app, a);
  std::string shell;
  CLI::App* completion = app.add_subcommand("completion", "Write what completes topple's words in a shell.");
  completion->add_option("shell", shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  add_examples(completion, R"(  topple completion bash > topple.bash     then: source topple.bash
  topple completion zsh > _topple          in a folder of $fpath
  topple completion fish > topple.fish     in ~/.config/fish/completions)");
  CLI::App* manual = app.add_subcommand("manual", "Write the manual page, for man -l.");
  add_examples(manual, R"(  topple manual > topple.1                 then: man -l topple.1)");
  add_version(app, a);
  refuse_empty_values(app);

  if (argc > 1 && argv[1][0] != '-') {
    std::vector<std::string> verbs;
    for (const CLI::App* verb : app.get_subcommands([](CLI::App*) { return true; })) verbs.push_back(verb->get_name());
    if (std::find(verbs.begin(), verbs.end(), argv[1]) == verbs.end()) {
      const std::string near = nearest_name(argv[1], verbs);
      std::cerr << "topple: there is no verb \"" << argv[1] << '"';
      if (!near.empty()) std::cerr << "; did you mean \"" << near << "\"?";
      std::cerr << "\nRun topple --help for the verbs.\n";
      return kBadInput;
    }
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ExtrasError& e) {
    const std::string unknown = find_unknown(app);
    if (!unknown.empty()) return refuse_words(app, argc, argv, unknown);
    std::ostringstream said;
    app.exit(e, std::cout, said);
    return refuse_words(app, argc, argv, said.str());
  } catch (const CLI::RequiredError& e) {
    // what is missing may be behind a word that nobody knows
    std::ostringstream said;
    if (const std::string unknown = find_unknown(app); unknown.empty())
      app.exit(e, std::cout, said);
    else
      said << unknown;
    return refuse_words(app, argc, argv, said.str());
  } catch (const CLI::ParseError& e) {
    std::ostringstream said;
    if (app.exit(e, std::cout, said) == 0) return kOk;
    return refuse_words(app, argc, argv, said.str());
  }
  if (completion->parsed()) {
    std::cout << make_completion(app, shell);
    return kOk;
  }
  if (manual->parsed()) {
    std::cout << make_manual(app);
    return kOk;
  }
  if (const std::string missing = find_missing(a); !missing.empty()) return refuse_words(app, argc, argv, missing);
  return a;
}

}  // namespace topple::apps
