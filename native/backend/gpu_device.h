// What the GPU back end asks of a device, so that the host can stand in for one in tests.
#pragma once

#include <cstdint>

namespace vlp {

// A Device queues work in two queues, each in order, and throws std::runtime_error for what goes wrong, then or later:
//   k_name                                       for messages
//   void* allocate(bytes, on_host)               null: there is no room
//   release(data, on_host)
//   upload(to, from, bytes)                      done when it returns
//   clear(to, bytes)                             queued in Queue::passes, as are the next two
//   launch(begin, end, body)                     body(i) for every i of [begin, end)
//   scan(counts, n, scratch, scratch_bytes)      exclusive sums in place
//   download(queue, to, from, bytes)            queued; `to` is memory on the host from `allocate`
//   Event, record(event, queue)                 an event is over when what was queued before is done; at first it is
//   queue_wait(queue, event)                    what is queued next waits for it
//   wait(event), bool is_over(event)
//   size_t stack_bytes()                         of the threads of the passes that run at a time
enum class Queue : uint8_t { passes, copies };

}  // namespace vlp
