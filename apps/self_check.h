#pragma once
/// Small calculations whose answers are known, for `topple doctor`.

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace topple::apps {

/// One number against what is known of it.
struct CheckedNumber {
  std::string what, unit;  // SI
  double expected = 0, got = 0;
  double tolerance = 0;  // of the difference [unit]; 0: the same number
  /// A number that is not finite is never ok.
  bool is_ok() const;
};

struct SelfCheck {
  std::string name, source;            // of what is expected
  std::vector<CheckedNumber> numbers;  // empty if it could not be done
  std::string failure;                 // why not
  double seconds = 0;                  // it took
  bool is_ok() const;
};

/// One of the calculations: fills the numbers, or throws.
struct SelfCheckCase {
  std::string name, source;
  std::function<std::vector<CheckedNumber>()> measure;
};

/// All of them, about two seconds in all.
///   scratch  existing folder for files, which are taken away again
std::vector<SelfCheckCase> make_self_checks(const std::filesystem::path& scratch);

/// Runs them in order; an exception is a failure of its case. Stops where `cancel` is set: what was not done is
/// left out.
std::vector<SelfCheck> run_self_checks(const std::vector<SelfCheckCase>&, const std::atomic<bool>& cancel);

bool all_ok(const std::vector<SelfCheck>&);

/// Aligned lines for people, a failed one begins with "FAILED".
std::string to_text(const std::vector<SelfCheck>&);

}  // namespace topple::apps
