// The program whose precompiled header the tests share; never run.
int main() { return 0; }
