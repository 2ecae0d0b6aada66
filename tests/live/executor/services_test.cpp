// Services: each request gets its answer or its timeout, once, where it belongs.
#include "dds/context_state.hpp"
#include "dds/message_pool.hpp"
#include "dds/names.hpp"
#include "dds/reader.hpp"
#include "dds/writer.hpp"
#include "executors.hpp"
#include "services/service_endpoint.hpp"
#include "services/service_type.hpp"
#include "support.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <test_services.hpp>

namespace cie::test {
namespace {

using Request = test_services::Add_Request;
using Response = test_services::Add_Response;
using ResponsePtr = std::shared_ptr<const Response>;

constexpr int kCalls = 100;

auto add(const Request& request, Response& response) { response.sum = request.a + request.b; }

class Services : public testing::TestWithParam<Kind> {
 protected:
  std::unique_ptr<Executor> make(ExecutorOptions options = {}) {
    return test::make(GetParam(), std::move(options));
  }
  Context context{private_options()};
  Node node{context, "node"};
};

INSTANTIATE_TEST_SUITE_P(Executors, Services, every_executor(), name_of);

TEST_P(Services, AnswerEachRequestWithItsOwnResponse) {
  const auto service = node.create_service<Request, Response>("add", add);
  const auto client = node.create_client<Request, Response>("add");
  const auto executor = make();
  executor->add_node(node);
  const Spinning spinning{*executor};
  ASSERT_TRUE(client->wait_for_service(20s));
  Request request{};
  for (int i = 0; i < kCalls; ++i) {
    request.a = i;
    request.b = 1000;
    auto future = client->async_send_request(request);
    ASSERT_EQ(future.wait_for(20s), std::future_status::ready);
    EXPECT_EQ(future.get()->sum, 1000 + i);
  }
  EXPECT_EQ(client->pending_requests(), 0U);
  EXPECT_EQ(service->client_count(), 1U);
}

TEST_P(Services, AnswerRequestsThatWaitTogetherInTheirOrder) {
  const QoS all{KeepAll{}};
  const auto service = node.create_service<Request, Response>("add", add, {}, all);
  const auto client = node.create_client<Request, Response>("add", {}, all);
  std::vector<std::int64_t> sums;  // of the client's thread alone
  std::atomic<int> count{0};
  Request request{};
  for (int i = 0; i < kCalls; ++i) {  // before anybody serves them
    request.a = i;
    client->async_send_request(request, [&](const ResponsePtr& response) {
      sums.push_back(response->sum);
      ++count;
    });
  }
  EXPECT_EQ(client->pending_requests(), std::size_t{kCalls});
  const auto executor = make();
  executor->add_node(node);
  Spinning spinning{*executor};
  EXPECT_TRUE(eventually([&] { return count == kCalls; }));
  spinning.cancel_and_wait();
  std::vector<std::int64_t> expected;
  for (int i = 0; i < kCalls; ++i)
    expected.push_back(i);
  EXPECT_EQ(sums, expected);
}

TEST_P(Services, AnswerEachClientAlone) {
  const auto service = node.create_service<Request, Response>("add", add);
  std::vector<std::shared_ptr<Client<Request, Response>>> clients;
  for (int i = 0; i < 3; ++i)
    clients.push_back(node.create_client<Request, Response>("add"));
  const auto executor = make();
  executor->add_node(node);
  const Spinning spinning{*executor};
  Request request{};
  for (int i = 0; i < kCalls; ++i) {
    std::vector<std::future<ResponsePtr>> futures;
    for (std::size_t k = 0; k < clients.size(); ++k) {
      request.a = static_cast<std::int64_t>(k);
      futures.push_back(clients[k]->async_send_request(request));
    }
    for (std::size_t k = 0; k < clients.size(); ++k) {
      ASSERT_EQ(futures[k].wait_for(20s), std::future_status::ready);
      EXPECT_EQ(futures[k].get()->sum, static_cast<std::int64_t>(k));
    }
  }
}

// By hand, because a client of ours has its reader first.
TEST_P(Services, AnswerOthersWhileAClientCannotHearYetAndItOnceItCan) {
  const auto service = node.create_service<Request, Response>("add", add);
  const auto client = node.create_client<Request, Response>("add");
  const auto executor = make();
  executor->add_node(node);
  const Spinning spinning{*executor};
  const executor::EndpointId id;
  const std::string identity = id.user_data("clientid");
  const ServicesQoS qos;
  const executor::ServiceType request_type{MessageTraits<Request>::descriptor()};
  executor::Writer requests{
      context.state(),           std::nullopt, executor::request_topic("/add"), qos,
      request_type.descriptor(), identity};
  std::vector<std::byte> request(requests.layout()->size());
  executor::set_header(request.data(), {.guid = id.guid(), .seq = 1});
  static_cast<Request*>(executor::payload_of(request.data()))->a = 5;
  ASSERT_TRUE(eventually([&] { return requests.matched() == 1; }));
  requests.publish(request.data());
  const Request of_another{};
  ASSERT_TRUE(client->wait_for_service(20s));
  EXPECT_EQ(client->async_send_request(of_another).get()->sum, 0);

  const executor::ServiceType response_type{MessageTraits<Response>::descriptor()};
  executor::Reader responses{context.state(),
                             executor::reply_topic("/add"),
                             qos,
                             response_type.descriptor(),
                             identity,
                             executor::Reader::Reply{.recipient = id.guid()}};
  executor::MessagePool pool{responses.layout()};
  executor::MessagePool::Loan response{pool};
  MessageInfo info;
  ASSERT_TRUE(eventually([&] { return responses.take(response, info); }, 20s));
  EXPECT_EQ(executor::header_of(response.get()).seq, 1);
  EXPECT_EQ(static_cast<const Response*>(executor::payload_of(response.get()))->sum, 5);
}

TEST_P(Services, BeginEachResponseEmpty) {
  const auto service =
      node.create_service<Request, Response>("add", [](const Request& request, Response& response) {
        if (request.a == 1) set_text(response.remark, "first");
        response.sum += request.a;
      });
  const auto client = node.create_client<Request, Response>("add");
  const auto executor = make();
  executor->add_node(node);
  const Spinning spinning{*executor};
  Request request{};
  std::vector<ResponsePtr> responses;
  for (request.a = 1; request.a <= 2; ++request.a)
    responses.push_back(client->async_send_request(request).get());
  EXPECT_STREQ(responses[0]->remark, "first");
  EXPECT_STREQ(responses[1]->remark, "");
  EXPECT_EQ(responses[0]->sum, 1);
  EXPECT_EQ(responses[1]->sum, 2);
}

TEST_P(Services, TimeOutWhenNobodyAnswers) {
  const auto client = node.create_client<Request, Response>("add", {.timeout = 5ms});
  EXPECT_FALSE(client->service_is_ready());
  EXPECT_FALSE(client->wait_for_service(1ms));
  const auto executor = make();
  executor->add_node(node);
  const Spinning spinning{*executor};
  Request request{};
  for (int round = 0; round < 3; ++round) {
    auto future = client->async_send_request(request);
    std::promise<ResponsePtr> called;
    client->async_send_request(request,
                               [&](const ResponsePtr& response) { called.set_value(response); });
    ASSERT_EQ(future.wait_for(20s), std::future_status::ready);
    EXPECT_THROW(future.get(), ServiceTimeout);
    EXPECT_EQ(called.get_future().get(), nullptr);
  }
  EXPECT_EQ(client->pending_requests(), 0U);
}

TEST_P(Services, DropAResponseThatComesTooLate) {
  std::atomic<bool> may_answer{false};
  std::atomic<int> asked{0};
  Node server{context, "server"};
  const auto service = server.create_service<Request, Response>(
      "/add", [&](const Request& request, Response& response) {
        ++asked;
        eventually([&] { return request.a != 0 || may_answer; });
        response.sum = request.a;
      });
  CallbackIsolatedExecutor serving;
  serving.add_node(server);
  const Spinning spinning_server{serving};
  const auto client = node.create_client<Request, Response>("/add", {.timeout = 10ms});
  const auto executor = make();
  executor->add_node(node);
  const Spinning spinning{*executor};
  Request request{};
  EXPECT_THROW(client->async_send_request(request).get(), ServiceTimeout);
  ASSERT_TRUE(eventually([&] { return asked == 1; }));
  may_answer = true;
  for (;;) {  // the late response is on its way before the next one
    request.a = 7;
    try {
      EXPECT_EQ(client->async_send_request(request).get()->sum, 7);
      break;
    } catch (const ServiceTimeout&) {  // a slow machine
    }
  }
}

TEST_P(Services, SendNothingWhenTheCallbackThrows) {
  std::atomic<int> failures{0};
  ExecutorOptions options;
  options.on_exception = [&](const CallbackFailure&) { ++failures; };
  const auto service = node.create_service<Request, Response>(
      "add", [](const Request&, Response&) { throw std::runtime_error{"no"}; });
  const auto client = node.create_client<Request, Response>("add", {.timeout = 20ms});
  const auto executor = make(options);
  executor->add_node(node);
  const Spinning spinning{*executor};
  Request request{};
  auto future = client->async_send_request(request);
  EXPECT_THROW(future.get(), ServiceTimeout);
  EXPECT_TRUE(eventually([&] { return failures == 1; }));
}

TEST_P(Services, ComeAndGoWhileSpinning) {
  const auto executor = make();
  const Spinning spinning{*executor};
  for (int round = 0; round < 20; ++round) {
    Node shortlived{context, "shortlived"};
    const auto service = shortlived.create_service<Request, Response>("add", add);
    executor->add_node(shortlived);
    const auto client = shortlived.create_client<Request, Response>("add", {.timeout = 1s});
    Request request{};
    request.a = round;
    auto future = client->async_send_request(request);
    if (round % 2 == 0) {
      EXPECT_EQ(future.get()->sum, round);
    }
  }
}

TEST(IsolatedServices, HaveAThreadForEachEnd) {
  Context context{private_options()};
  Node node{context, "node", "/car"};
  std::set<std::thread::id> threads;
  std::promise<std::int64_t> sum;
  std::thread::id of_service;
  const auto service = node.create_service<Request, Response>(
      "add", [&](const Request& request, Response& response) {
        of_service = std::this_thread::get_id();
        add(request, response);
      });
  std::thread::id of_client;
  const auto client = node.create_client<Request, Response>("add");
  EXPECT_EQ(service->logical_id(), "/car/node@Service(/car/add)");
  EXPECT_EQ(client->logical_id(), "/car/node@Client(/car/add)");
  EXPECT_EQ(client->service_name(), "/car/add");
  std::atomic<bool> is_done{false};
  std::thread::id of_timer;
  const auto timer = node.create_wall_timer(1ms, [&] {
    if (is_done) return;
    of_timer = std::this_thread::get_id();
    Request request{};
    request.a = 20;
    request.b = 22;
    std::promise<void> called;
    client->async_send_request(request, [&](const ResponsePtr&) {
      of_client = std::this_thread::get_id();
      called.set_value();
    });
    called.get_future().wait();
    const auto response = client->async_send_request(request).get();  // waits inside a callback
    sum.set_value(response->sum);
    is_done = true;
  });
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  Spinning spinning{executor};
  EXPECT_EQ(sum.get_future().get(), 42);
  spinning.cancel_and_wait();
  EXPECT_EQ((std::set{of_service, of_client, of_timer, std::this_thread::get_id()}).size(), 4U);
}

TEST(ServicePromises, BreakWhenTheClientGoes) {
  Context context{private_options()};
  std::future<ResponsePtr> future;
  {
    Node node{context, "node"};
    const auto client = node.create_client<Request, Response>("add");
    Request request{};
    future = client->async_send_request(request);
  }
  EXPECT_THROW(future.get(), std::future_error);
}

TEST(ServiceOptions, RefuseANegativeTimeout) {
  Context context{private_options()};
  Node node{context, "node"};
  EXPECT_THROW(((void)node.create_client<Request, Response>("add", {.timeout = -1ns})),
               std::invalid_argument);
}

}  // namespace
}  // namespace cie::test
