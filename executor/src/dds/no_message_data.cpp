// Built instead of message_data.cpp with CIE_MESSAGES_BY_POINTER=OFF: no type can be passed by
// pointer, and so there is no such sample either.
#include "message_data.hpp"

namespace cie::executor {

ddsi_sertype* make_pointer_type(LayoutPtr) { return nullptr; }
ddsi_serdata* make_message_data(const ddsi_sertype&, std::shared_ptr<const void>) noexcept {
  return nullptr;
}
std::shared_ptr<const void> message_of(const ddsi_serdata&) noexcept { return nullptr; }
bool is_refused(const ddsi_serdata&) noexcept { return false; }
bool is_unreadable(const ddsi_serdata&) noexcept { return false; }

}  // namespace cie::executor
