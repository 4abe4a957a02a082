#pragma once
/// Where a study lies and what it studies, from what was typed or from what lies in its store.

#include <string>

#include "arguments.h"
#include "study/manager.h"
#include "study/problem.h"
#include "study/store.h"

namespace topple::apps {

/// Address of a store, and the name of the study in it.
struct StudyPlace {
  std::string store;
  std::string name = "main";
  bool is_new = false;  // on a server, and its folder knows of none
};

/// Runs of an evaluator on a server are its study's own: the same command may be another program in another place.
void keep_runs_apart(study::Problem&, const StudyPlace&);

/// For a new study, or one to go on with; makes the folder if nothing is wrong. Throws InputError E801, E820, E822
/// (another study is there).
StudyPlace make_place(const Arguments&);
/// Notes in the folder on which server its study is.
void keep_place(const std::string& folder, const StudyPlace&);
/// Removes the file of a new store in which nothing was found, unless others work in it; whether it did.
///   answers  how many it must hold, should a full disk not let it be read
bool remove_unused(const StudyPlace&, const std::string& model, long answers);
/// Of a study that is there: its folder, or a server. Throws InputError E820.
StudyPlace find_place(const std::string& folder_or_server);

/// Kinds of models that this program can run.
study::RunnerFactories make_factories();

/// Reads the file that was typed. `text` is what was read.
study::Problem read_problem(const Arguments&, std::string& text);
/// The problem of a study in a store. Throws InputError E820.
study::Problem read_problem(const study::StudyRow&);

/// The workers that were asked for. Throws InputError E801.
study::PoolOptions make_pool_options(const StudyArguments&);
/// Seconds of a typed time; `fallback` if there is none.
double read_seconds(const std::string& text, const char* option, double fallback);

}  // namespace topple::apps
