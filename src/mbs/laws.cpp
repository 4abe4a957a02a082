#include "mbs/laws.h"

#include <atomic>
#include <mutex>
#include <utility>

#include "mbs/zone_law.h"

namespace topple::mbs {

struct SharedLaw::Made {
  explicit Made(ZoneLaw l) : law(std::move(l)) {}
  const ZoneLaw law;
  std::once_flag once;
  std::shared_ptr<const CompiledLaw> compiled;
  std::atomic<bool> is_checked = false;
};

SharedLaw::SharedLaw(ZoneLaw law) : made_(std::make_shared<Made>(std::move(law))) {}

const ZoneLaw& SharedLaw::operator*() const { return made_->law; }

std::shared_ptr<const CompiledLaw> SharedLaw::compile() const {
  std::call_once(made_->once,
                 [this] { made_->compiled = std::make_shared<const CompiledLaw>(compile_law(made_->law)); });
  return made_->compiled;
}

bool SharedLaw::is_checked() const { return made_->is_checked.load(std::memory_order_relaxed); }
void SharedLaw::note_checked() const { made_->is_checked.store(true, std::memory_order_relaxed); }

}  // namespace topple::mbs
