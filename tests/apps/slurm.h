#pragma once
/// A real Slurm of its own for a test: munge, one controller and two nodes of one processor each on this machine, all
/// below a temporary folder, on free ports of the loopback.

#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "../study/server.h"

namespace topple::study {

class Slurm {
 public:
  /// nullptr where Slurm or munge is not installed.
  static std::unique_ptr<Slurm> make() {
    for (const char* program : {"/usr/sbin/slurmctld", "/usr/sbin/slurmd", "/usr/sbin/munged", "/usr/bin/sbatch"})
      if (access(program, X_OK) != 0) return nullptr;
    return std::unique_ptr<Slurm>(new Slurm);
  }
  ~Slurm() {
    for (auto pid = started_.rbegin(); pid != started_.rend(); ++pid) kill(*pid, SIGTERM);
    for (const pid_t pid : started_) {
      for (int i = 0; i < 200 && waitpid(pid, nullptr, WNOHANG) == 0; ++i) {
        if (i == 150) kill(pid, SIGKILL);
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
    }
  }
  Slurm(const Slurm&) = delete;
  Slurm& operator=(const Slurm&) = delete;

  /// Output of one of Slurm's commands; empty if it fails.
  std::string ask(const std::string& command) const {
    const std::string line = "SLURM_CONF=" + configuration() + " " + command + " 2>>" + (folder_ / "commands.log");
    std::FILE* pipe = popen(line.c_str(), "r");
    if (!pipe) return {};
    std::string text;
    std::array<char, 4096> buffer{};
    while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe)) text.append(buffer.data(), n);
    return pclose(pipe) == 0 ? text : std::string();
  }
  /// Number of the job that a script became.
  std::string submit(const std::string& script) const {
    const std::string path = folder_ / "job.sh";
    std::ofstream(path) << script;
    std::string number = ask("sbatch --parsable --output=" + (folder_ / "job-%A_%a.log") + " " + path);
    while (!number.empty() && std::isspace(static_cast<unsigned char>(number.back()))) number.pop_back();
    return number;
  }
  std::string read_log(const std::string& job) const {
    std::ifstream in(folder_ / ("job-" + job + ".log"));
    return {std::istreambuf_iterator<char>(in), {}};
  }

 private:
  std::string configuration() const { return folder_ / "slurm.conf"; }

  Slurm() {
    char host[256] = {};
    gethostname(host, sizeof host - 1);
    std::string name = host;
    name = name.substr(0, name.find('.'));
    const std::string user = getpwuid(geteuid())->pw_name;
    // munge wants folders that others may enter
    chmod(folder_.path().c_str(), 0755);
    std::filesystem::create_directory(folder_ / "state");
    {
      std::ofstream key(folder_ / "munge.key", std::ios::binary);
      std::random_device random;
      for (int i = 0; i < 1024; ++i) key.put(static_cast<char>(random()));
    }
    chmod((folder_ / "munge.key").c_str(), 0400);
    const auto at = [this](const char* file) { return folder_ / file; };
    std::ofstream conf(configuration());
    conf << "ClusterName=test\nSlurmctldHost=" << name << "(127.0.0.1)\nSlurmUser=" << user << "\nSlurmdUser=" << user
         << "\nAuthType=auth/munge\nCredType=cred/munge\nAuthInfo=socket=" << at("munge.socket")
         << "\nSlurmctldPort=" << find_port() << "\nSlurmctldPidFile=" << at("controller.pid")
         << "\nSlurmdPidFile=" << at("node-%n.pid") << "\nSlurmdSpoolDir=" << at("spool-%n")
         << "\nStateSaveLocation=" << at("state") << "\nSlurmctldLogFile=" << at("controller.log")
         << "\nSlurmdLogFile=" << at("node-%n.log")
         << "\nProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nJobAcctGatherType=jobacct_gather/none\n"
            "AccountingStorageType=accounting_storage/none\nSelectType=select/cons_tres\n"
            "SelectTypeParameters=CR_CPU\nSchedulerType=sched/builtin\nMpiDefault=none\nReturnToService=2\n"
            "MailProg=/bin/true\nSlurmdParameters=config_overrides\nKillWait=5\n";
    for (int i = 1; i <= 2; ++i)
      conf << "NodeName=n" << i << " NodeHostname=" << name << " NodeAddr=127.0.0.1 Port=" << find_port()
           << " CPUs=1 State=UNKNOWN\n";
    conf << "PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP\n";
    conf.close();
    start({"/usr/sbin/munged", "--foreground", "--force", "--socket=" + at("munge.socket"),
           "--key-file=" + at("munge.key"), "--pid-file=" + at("munge.pid"), "--log-file=" + at("munge.log"),
           "--seed-file=" + at("munge.seed")});
    wait([&] { return access(at("munge.socket").c_str(), F_OK) == 0; }, "munge");
    start({"/usr/sbin/slurmctld", "-D", "-i", "-f", configuration()});
    for (const char* node : {"n1", "n2"}) start({"/usr/sbin/slurmd", "-D", "-N", node, "-f", configuration()});
    wait([&] { return ask("sinfo --noheader --format=%D --states=idle").find('2') == 0; }, "its nodes");
  }
  void start(const std::vector<std::string>& words) { started_.push_back(spawn(words, folder_ / "daemons.log")); }
  template <class F>
  static void wait(F is_so, const std::string& for_what) {
    for (int i = 0; i < 1200; ++i) {
      if (is_so()) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    throw std::runtime_error("Slurm: " + for_what + " do not come up");
  }

  Folder folder_;
  std::vector<pid_t> started_;
};

}  // namespace topple::study
