#include "study/database.h"

#include <algorithm>

#include "base/error.h"

namespace topple::study {

bool is_server(const std::string& address) {
  return address.starts_with("postgresql://") || address.starts_with("postgres://");
}

std::string hide_password(const std::string& address) {
  if (!is_server(address)) return address;
  const std::size_t host = address.find("//") + 2;
  const std::size_t end = std::min(address.find_first_of("/?", host), address.size());
  const std::size_t at = address.rfind('@', end);
  const std::size_t colon = address.find(':', host);
  std::string shown = address;
  if (at != std::string::npos && at >= host && colon != std::string::npos && colon < at) shown.erase(colon, at - colon);
  // also as a parameter behind the name
  for (const char* key : {"?password=", "&password=", "?sslpassword=", "&sslpassword="})
    if (const std::size_t found = shown.find(key); found != std::string::npos) {
      const std::size_t value = found + std::string(key).size();
      shown.replace(value, std::min(shown.find('&', value), shown.size()) - value, "...");
    }
  return shown;
}

std::unique_ptr<Database> open_database(const std::string& address, bool is_read_only) {
  if (!is_server(address)) return open_sqlite(address, is_read_only);
#ifdef TOPPLE_POSTGRESQL
  return open_postgresql(address);
#else
  throw InputError("E821", "this topple was built without PostgreSQL", "install libpq-dev and build it again");
#endif
}

}  // namespace topple::study
