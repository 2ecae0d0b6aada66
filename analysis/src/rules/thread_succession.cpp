#include "thread_succession.hpp"

#include "thread_questions.hpp"

namespace cie::analysis {

Succession succession(const RuleContext& context, ThreadIndex earlier, ThreadIndex later) {
  const auto last_sign = context.lives.of(earlier).end;
  const auto next_begin = context.lives.of(later).begin;
  const auto& thread = thread_of(context.model, earlier);
  const bool is_same_tid = thread.tid == thread_of(context.model, later).tid;
  const auto& ended_by = context.lives.of(earlier).ended_by;
  // One that begins in the very nanosecond that the other ended in follows it.
  const bool is_alive = ended_by ? next_begin < last_sign : next_begin <= last_sign;
  if (is_alive) return is_same_tid ? Succession::successive : Succession::together;
  if ((ended_by && *ended_by <= next_begin) || is_same_tid) return Succession::successive;
  if (lived_on(context, earlier, next_begin) != nullptr) return Succession::together;
  // A tid is given anew only after its thread's exit.
  return context.lives.is_tid_given_anew(earlier, last_sign, next_begin) ? Succession::successive
                                                                         : Succession::unknown;
}

const EventRef* lived_on(const RuleContext& context, ThreadIndex index, Timestamp until) {
  const auto& thread = thread_of(context.model, index);
  const auto& last = thread.switched_in;
  if (!last || last->time < until) return nullptr;
  const auto& proof = context.proof;
  const auto since = context.lives.of(index).end;
  const bool is_in_doubt = (thread.announced && proof.loss(index)) ||
                           context.user_losses.between(thread.process, since, last->time) ||
                           context.lives.may_be_another(index, last->time);
  return is_in_doubt ? nullptr : &*last;
}

}  // namespace cie::analysis
