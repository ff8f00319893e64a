// Progress on standard error: a bar on a terminal, plain lines otherwise; and
// the user's wish to stop.
#pragma once

#include <cstddef>
#include <string>

namespace splitcubes::app {

class Progress {
  public:
    Progress(std::string what, std::size_t total);
    /// Shows that `done` of the total are done; `detail` stands behind the bar.
    void show(std::size_t done, const std::string& detail = "");
    /// Ends the bar's line.
    void finish();

  private:
    std::string what_;
    std::size_t total_;
    bool terminal_;
    int last_tenth_ = -1;
    bool open_line_ = false;
};

/// From the first call on, SIGINT and SIGTERM only set a flag that
/// interrupted() returns; a second one ends the program at once.
void watch_interrupts();
bool interrupted();

}  // namespace splitcubes::app
