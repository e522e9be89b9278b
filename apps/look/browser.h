#pragma once

#include <string>

namespace nephele::apps {

/// Shows an address in the browser of the desktop, if there is one; nothing waits for it.
void openBrowser(const std::string& address);

}  // namespace nephele::apps
