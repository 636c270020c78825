// Which place a number has in a list that grows while it is made.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "framework/types.hpp"

namespace halfgrad {

/// Places by number (≥ 0): a table with open addressing, at most half full.
class Places {
 public:
  explicit Places(std::size_t num_expected) : slots_(std::bit_ceil(2 * num_expected + 2)) {}

  void clear() {
    slots_.assign(slots_.size(), {});
    num_used_ = 0;
  }

  /// The place of a number, valid until the next call; −1 where it is new, to be set by the caller.
  Index& of(Index number) {
    Slot* slot = &find(number);
    if (slot->number == number) return slot->place;
    if (2 * ++num_used_ > slots_.size()) {
      std::vector<Slot> old(2 * slots_.size());
      old.swap(slots_);
      for (const Slot& each : old)
        if (each.number >= 0) find(each.number) = each;
      slot = &find(number);
    }
    *slot = {number, -1};
    return slot->place;
  }

 private:
  struct Slot {
    Index number = -1, place = -1;
  };

  // The slot of a number, or the empty one where it would go.
  Slot& find(Index number) {
    std::size_t at = static_cast<std::uint32_t>(number) * 2654435769u;
    for (at ^= at >> 16;; ++at) {
      Slot& slot = slots_[at & (slots_.size() - 1)];
      if (slot.number == number || slot.number < 0) return slot;
    }
  }

  std::vector<Slot> slots_;
  std::size_t num_used_ = 0;
};

}  // namespace halfgrad
