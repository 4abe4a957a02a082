#include "record/record.h"

#include <stdexcept>

namespace topple::record {

std::string_view name_of(Status status) {
  switch (status) {
    case Status::Info:
      return "info";
    case Status::Good:
      return "good";
    case Status::Warning:
      return "warning";
    case Status::Bad:
      return "bad";
  }
  throw std::logic_error("record: unknown status");
}

}  // namespace topple::record
