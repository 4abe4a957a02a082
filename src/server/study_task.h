#pragma once
/// A fuzzy study that runs beside the sessions: progress, bounds and samples as they come.

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "product/plan.h"
#include "server/json.h"
#include "study/manager.h"

namespace topple::server {

struct StudySetting {
  std::string folder, rules, version;
  int samples = 300;
  std::uint64_t seed = 1;
  int jobs = 1;
};

class StudyTask {
 public:
  /// Starts. Throws InputError E950 for a plan without [fuzzy], and as study::make_plan_problem does.
  ///   on_news  from its own thread: the study, and the samples that are new
  StudyTask(int id, const product::Plan&, const StudySetting&,
            std::function<void(const Json& study, const Json& samples)> on_news);
  ~StudyTask();

  int id() const { return id_; }
  void cancel() { cancel_ = true; }
  Json describe() const;
  Json samples() const;                             // all that are known
  std::vector<double> inputs_of(int sample) const;  // throws InputError E920
  std::string words_of(int sample) const;
  const product::Plan& plan() const { return plan_; }
  std::string results_json() const;  // as `topple study` writes it
  std::string page_json() const;     // data of study.html

 private:
  void run();
  void look(const study::StudyState*);
  study::StudyResult read() const;

  int id_;
  product::Plan plan_;
  StudySetting setting_;
  std::string store_;
  study::Problem problem_;
  std::function<void(const Json&, const Json&)> on_news_;
  std::atomic<bool> cancel_ = false;
  mutable std::mutex mutex_;
  Json now_;
  Json samples_ = Json::array();
  std::vector<std::string> seen_;  // hashes, by index of the sample
  std::chrono::steady_clock::time_point last_look_;
  std::thread thread_;
};

}  // namespace topple::server
