#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>

#include "arguments.h"
#include "base/error.h"
#include "base/unfinished_file.h"
#include "commands.h"
#include "program.h"
#include "results.h"
#include "study/store.h"

namespace {

std::atomic<bool> cancel = false;

bool ignores_hangup = false;  // nohup: the program goes on when its terminal is gone

/// By a terminal, a batch system and a connection that is lost.
extern "C" void set_endings(void (*handler)(int)) {
  std::signal(SIGINT, handler);
  std::signal(SIGTERM, handler);
  if (!ignores_hangup) std::signal(SIGHUP, handler);
}

/// The first interrupt ends the run at its next step with its record written; a later one ends the program. One that
/// follows at once is the first again: timeout and batch systems send it to the process and to its group.
extern "C" void on_interrupt(int signal) {
  constexpr std::int64_t same = 300;  // ms
  static std::atomic<std::int64_t> first = 0;
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const std::int64_t time = now.tv_sec * std::int64_t{1000} + now.tv_nsec / 1000000;
  if (!cancel.exchange(true, std::memory_order_relaxed)) {
    first = time;
  } else if (time - first > same) {
    set_endings(SIG_DFL);
    raise(signal);
  }
}

/// Of verbs that write whole files at their end: the program ends at once.
extern "C" void on_interrupt_of_short(int) {
  constexpr char words[] = "Cancelled.\n";
  topple::remove_unfinished_file();
  if (write(STDERR_FILENO, words, sizeof words - 1) < 0) _exit(topple::apps::kRunFailed);
  _exit(topple::apps::kRunFailed);
}

/// Whether a verb looks at `cancel` while it works.
bool heeds_cancel(const topple::apps::Arguments& a) {
  using Verb = topple::apps::Arguments::Verb;
  switch (a.verb) {
    case Verb::New:
    case Verb::Check:
    case Verb::Rules:
    case Verb::Report:
    case Verb::Import:
    case Verb::Compare:
      return false;
    case Verb::Export:
      return !a.adams && !a.fe.lsdyna;
    case Verb::Fe:
      return !a.fe.mesh_only;
    default:
      return true;
  }
}

int dispatch(const topple::apps::Arguments& a) {
  if (!heeds_cancel(a)) {
    set_endings(on_interrupt_of_short);
    if (cancel) on_interrupt_of_short(SIGINT);
  } else {
    std::signal(SIGPIPE, SIG_IGN);  // what reads the words may end first: files are written all the same
  }
  using topple::apps::Arguments;
  switch (a.verb) {
    case Arguments::Verb::New:
      return topple::apps::write_template(a);
    case Arguments::Verb::Check:
      return topple::apps::check_plan(a);
    case Arguments::Verb::Run:
      return topple::apps::run_plan_file(a, cancel);
    case Arguments::Verb::Rules:
      return topple::apps::show_rules(a);
    case Arguments::Verb::MbsRun:
      return topple::apps::run_model_file(a, cancel);
    case Arguments::Verb::MbsCompare:
      return topple::apps::compare_engines(a, cancel);
    case Arguments::Verb::MbsVerify:
      return topple::apps::verify_engine(a, cancel);
    case Arguments::Verb::Report:
      return topple::apps::write_report_file(a);
    case Arguments::Verb::Export:
      return topple::apps::export_file(a, cancel);
    case Arguments::Verb::Import:
      return topple::apps::import_file(a);
    case Arguments::Verb::Rcc:
      return topple::apps::compute_rcc(a, cancel);
    case Arguments::Verb::Study:
      return topple::apps::run_study_command(a, cancel);
    case Arguments::Verb::Compare:
      return topple::apps::compare_records(a);
    case Arguments::Verb::Fe:
      return topple::apps::run_finite_elements(a, cancel);
    case Arguments::Verb::Steer:
      return topple::apps::steer(a, cancel);
    case Arguments::Verb::Replay:
      return topple::apps::replay_log(a, cancel);
    case Arguments::Verb::Worker:
      return topple::apps::run_worker(a, cancel);
    case Arguments::Verb::Demo:
      return topple::apps::run_demo(a, cancel);
    case Arguments::Verb::Doctor:
      return topple::apps::examine(a, cancel);
    case Arguments::Verb::Version:
      std::printf(a.json ? "{\"program\": \"topple\", \"version\": \"%s\"}\n" : "topple %s\n",
                  topple::apps::program_version().c_str());
      return topple::apps::kOk;
    case Arguments::Verb::None:
      break;
  }
  return topple::apps::kBadInput;
}

}  // namespace

int main(int argc, char** argv) {
  if (std::signal(SIGHUP, SIG_IGN) == SIG_IGN) ignores_hangup = true;
  set_endings(on_interrupt);
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);  // complaints on standard error stand between lines
  std::signal(SIGXFSZ, SIG_IGN);                  // a file that may not grow is an error of its own
  topple::study::on_waiting([](const std::string& what) {
    std::fprintf(stderr, "%stopple: %s\n", isatty(fileno(stderr)) != 0 ? "\r\x1b[K" : "", what.c_str());
  });
  const auto arguments = topple::apps::parse_arguments(argc, argv);
  // of some verbs it is a format
  const auto wants_json = [&arguments] {
    using Verb = topple::apps::Arguments::Verb;
    const auto* given = std::get_if<topple::apps::Arguments>(&arguments);
    return given && given->json && given->verb != Verb::Export && given->verb != Verb::Rules;
  };
  try {
    const int* stop = std::get_if<int>(&arguments);
    const int code = stop ? *stop : dispatch(std::get<topple::apps::Arguments>(arguments));
    if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return code;
    std::fprintf(stderr, "topple: standard output could not be written\n");
    return code == topple::apps::kBadInput ? code : topple::apps::kRunFailed;
  } catch (const topple::InputError& e) {
    std::fprintf(stderr, "%s\n", e.what());
    if (wants_json()) topple::apps::print_refusal(e.diagnostics());
    return topple::apps::kBadInput;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "topple: %s\n", e.what());
    if (wants_json()) topple::apps::print_failure(e.what());
    return topple::apps::kRunFailed;
  }
}
