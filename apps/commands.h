#pragma once
/// The verbs of the command line; each returns its exit code.

#include <atomic>

#include "arguments.h"

namespace topple::apps {

int write_template(const Arguments&);
int check_plan(const Arguments&);
int run_plan_file(const Arguments&, const std::atomic<bool>& cancel);
int show_rules(const Arguments&);
int run_model_file(const Arguments&, const std::atomic<bool>& cancel);
int compare_engines(const Arguments&, const std::atomic<bool>& cancel);
int verify_engine(const Arguments&, const std::atomic<bool>& cancel);
int write_report_file(const Arguments&);
int export_file(const Arguments&, const std::atomic<bool>& cancel);
int import_file(const Arguments&);
int compute_rcc(const Arguments&, const std::atomic<bool>& cancel);
int run_study_command(const Arguments&, const std::atomic<bool>& cancel);
int compare_records(const Arguments&);
int run_finite_elements(const Arguments&, const std::atomic<bool>& cancel);
int steer(const Arguments&, const std::atomic<bool>& cancel);
int replay_log(const Arguments&, const std::atomic<bool>& cancel);
int run_worker(const Arguments&, const std::atomic<bool>& cancel);
int run_demo(const Arguments&, const std::atomic<bool>& cancel);
int examine(const Arguments&, const std::atomic<bool>& cancel);

}  // namespace topple::apps
