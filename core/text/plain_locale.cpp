#include "feeler/core/text/plain_locale.h"

#include <locale>
#include <mutex>
#include <optional>
#include <string>

namespace feeler {
namespace {

/// The global locale is one for all threads: the first in puts the plain one, the last out puts the host's back.
struct HostLocale {
  std::mutex mutex;
  int inside = 0;
  std::optional<std::locale> cpp;  ///< if it was another than the plain one
  std::string c;                   ///< name of the one of setlocale, which std::locale::global changes as well
};

HostLocale& Host() {
  static HostLocale host;
  return host;
}

}  // namespace

PlainLocale::PlainLocale() : plain_(newlocale(LC_ALL_MASK, "C", nullptr)), before_(uselocale(plain_)) {
  HostLocale& host = Host();
  const std::lock_guard lock(host.mutex);
  if (host.inside++ > 0) return;
  const std::locale now;
  if (now == std::locale::classic()) return;
  const char* name = std::setlocale(LC_ALL, nullptr);
  host.c = name == nullptr ? "C" : name;
  host.cpp = now;
  std::locale::global(std::locale::classic());
}

PlainLocale::~PlainLocale() {
  {
    HostLocale& host = Host();
    const std::lock_guard lock(host.mutex);
    if (--host.inside == 0 && host.cpp) {
      std::locale::global(*host.cpp);
      std::setlocale(LC_ALL, host.c.c_str());
      host.cpp.reset();
    }
  }
  uselocale(before_);
  if (plain_ != locale_t{}) freelocale(plain_);
}

}  // namespace feeler
