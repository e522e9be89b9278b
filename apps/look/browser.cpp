#include "apps/look/browser.h"

#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>

namespace nephele::apps {

void openBrowser(const std::string& address) {
  if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY")) return;
  const pid_t child = fork();
  if (child == 0) {
    // Its parent ends at once, and the system's first process takes it over and waits for it.
    if (fork() == 0) execlp("xdg-open", "xdg-open", address.c_str(), static_cast<char*>(nullptr));
    _exit(0);
  }
  if (child > 0) waitpid(child, nullptr, 0);
}

}  // namespace nephele::apps
