// Stands in for libspnav.so.0 and its daemon: the mouse is pushed to the right and away for fifty looks at
// it, and then let alone. Events are laid out as libspnav has them.
namespace {
union Event {
  int type;
  struct {
    int type, x, y, z, rx, ry, rz;
    unsigned period;
    int *data;
  } motion;
};
int looks = 0;
bool reported = false;
}  // namespace

extern "C" {
__attribute__((visibility("default"))) int spnav_open() { return 0; }
__attribute__((visibility("default"))) int spnav_close() { return 0; }
// One event a look: the second call of each finds none.
__attribute__((visibility("default"))) int spnav_poll_event(Event *event) {
  reported = !reported;
  if (!reported) return 0;
  ++looks;
  *event = {};
  event->motion.type = 1;
  event->motion.x = looks <= 50 ? 350 : 0;
  event->motion.z = looks <= 50 ? 175 : 0;
  return 1;
}
}
