#pragma once

// Of the OpenMP that CHOLMOD is linked with, if it is.
extern "C" {
int omp_get_max_active_levels() __attribute__((weak));
void omp_set_max_active_levels(int) __attribute__((weak));
}

namespace nephele::detail {

/// While it lives, OpenMP regions that this thread enters have one thread: CHOLMOD opens thousands of short
/// ones, with a number of threads that it fixes itself, which take twice as long on two threads as on one.
/// Other threads are left alone: the setting belongs to the thread that makes it.
class OneThread {
 public:
  OneThread() : before_(isThere() ? omp_get_max_active_levels() : 0) {
    if (isThere()) omp_set_max_active_levels(0);
  }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;
  ~OneThread() {
    if (isThere()) omp_set_max_active_levels(before_);
  }

 private:
  static bool isThere() { return omp_get_max_active_levels && omp_set_max_active_levels; }
  int before_;
};

}  // namespace nephele::detail
