// A shared object that is no component library.
namespace container_test {
int unused() { return 1; }
}  // namespace container_test
