#pragma once
/// All sessions, studies and clients of a server, and what the routes answer. Any thread; knows no sockets.

#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/session.h"
#include "server/study_task.h"

namespace topple::server {

struct HubOptions {
  SessionSetting session;
  std::string plans;   // folder of plans that may be opened
  std::string page;    // the steering page; empty: not built
  std::string report;  // the report page to fill; empty: not built
  std::string study;   // the page of studies to fill; empty: not built
  SessionPlan demo;    // to show what there is; without text: none
  std::size_t most_sessions = 8;
  int study_jobs = 1;
};

struct Reply {
  int status = 200;
  std::string type = "application/json";
  std::string body;
  std::string file_name;  // to save it under; empty: none
};

Reply make_error_reply(int status, const std::string& code, const std::string& message, const std::string& help = {});

class Hub {
 public:
  explicit Hub(HubOptions);
  ~Hub();
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;

  /// Opens a session; its number. Throws InputError E905.
  int open(SessionPlan);

  /// Answers a GET of a path behind the token, "/api/..."; from any thread, maybe at once.
  void get(const std::string& path, std::function<void(Reply)>);

  /// A new connection: of a client that comes back, or of a new one.
  std::shared_ptr<Client> connect(std::shared_ptr<Outlet>, const std::string& resume, std::optional<long> after);
  void disconnect(const std::shared_ptr<Client>&, const Outlet*);
  /// A text of a client. Everything wrong with it is answered. Each call leads to one Outlet::answered().
  void receive(const std::shared_ptr<Client>&, const std::string& text);

  /// Ends sessions, studies and whatever is under way; nothing is answered any more.
  void close();
  /// Says goodbye to all.
  void say_bye(const std::string& reason);

 private:
  std::shared_ptr<Session> find_session(int id) const;
  std::shared_ptr<StudyTask> find_study(int id) const;
  Json list_sessions() const;
  Json list_plans() const;
  Json list_templates() const;
  /// A building (IFC) or a site (DXF) as text of a plan; answered from elsewhere.
  void import_plan(const std::shared_ptr<Client>&, std::int64_t id, const Json& command);
  SessionPlan read_plan_of(const Json& command) const;
  void tell_sessions();
  void tell_study(int study, const Json& state, const Json& samples);
  /// Commands that no session answers; nothing if it is one of a session.
  std::optional<Json> perform(const std::shared_ptr<Client>&, const std::string& word, const Json& command);
  void start_study(const std::shared_ptr<Client>&, std::int64_t id, const Json& command,
                   const std::shared_ptr<Session>&);
  void play_sample(const std::shared_ptr<Client>&, std::int64_t id, const Json& command,
                   const std::shared_ptr<Session>&);
  /// A file of a branch's record: findings, record.json, record.h5 or report.html.
  Reply write_record(const JudgedBranch&, const std::string& what) const;
  void forget_old_clients();
  /// Work that must not hold up the sockets.
  void run_errand(std::function<void()>);
  void work_errands();
  std::vector<std::shared_ptr<Client>> all_clients() const;

  HubOptions options_;
  mutable std::mutex mutex_;
  std::map<int, std::shared_ptr<Session>> sessions_;
  std::map<int, std::shared_ptr<StudyTask>> studies_;
  std::map<std::string, std::shared_ptr<Client>> clients_;
  std::map<int, std::vector<std::weak_ptr<Client>>> study_watchers_;
  int last_session_ = 0, last_study_ = 0;

  std::mutex errand_mutex_;
  std::condition_variable errand_wakes_;
  std::deque<std::function<void()>> errands_;
  bool closing_ = false;
  std::thread errand_thread_;
};

}  // namespace topple::server
