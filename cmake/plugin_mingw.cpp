// In each C++ plugin by MinGW: the run-time library inside it takes 73 kB at load, for exceptions where no
// memory is left, and gives them back when it is told to.
namespace __gnu_cxx {
void __freeres();
}
[[gnu::destructor]] static void give_back() { __gnu_cxx::__freeres(); }
