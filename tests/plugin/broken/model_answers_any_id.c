/* V03: answers an id that it cannot know. */
#define OTHER_ID &steps
#include "stepper.h"
