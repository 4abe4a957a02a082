#include "browser.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <thread>

namespace topple::apps {

void open_browser(const std::string& address) {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return;
  std::string program = "xdg-open", copy = address;
  char* arguments[] = {program.data(), copy.data(), nullptr};
  // what this program ignores is its own affair
  sigset_t own;
  sigemptyset(&own);
  sigaddset(&own, SIGPIPE);
  posix_spawnattr_t how;
  if (posix_spawnattr_init(&how) != 0) return;
  posix_spawnattr_setsigdefault(&how, &own);
  posix_spawnattr_setflags(&how, POSIX_SPAWN_SETSIGDEF);
  pid_t child = 0;
  if (posix_spawnp(&child, "xdg-open", nullptr, &how, arguments, environ) == 0)
    std::thread([child] { waitpid(child, nullptr, 0); }).detach();
  posix_spawnattr_destroy(&how);
}

}  // namespace topple::apps
