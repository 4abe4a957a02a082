#pragma once
/// A branch as it was at one moment, with what is found of it.

#include <memory>
#include <string>
#include <vector>

#include "record/record.h"
#include "server/json.h"

namespace topple::server {

struct JudgedBranch {
  int branch = 0;
  double time = 0;  // of its frontier then [s]
  record::Record record;
  std::vector<std::string> notes;  // of its model
  struct Edit {
    double time = 0;  // [s]
    std::string text;
  };
  std::vector<Edit> edits;            // along it, from the plan's start on
  std::shared_ptr<const void> start;  // the same of all branches that share the instant 0; null: not known
};

/// The answer of `findings` (docs/protocol.md).
Json describe_findings(const JudgedBranch&);

/// The answer of `compare`: both at the frames of either within the time they share, at most `count`. Each has at least
/// one frame. Of what they share at the instant 0 their findings do not differ, though one that has ended tells more.
Json compare(const JudgedBranch& a, const JudgedBranch& b, int count);

}  // namespace topple::server
