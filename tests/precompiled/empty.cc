// Precompiled headers need a target with a source.
int main() { return 0; }
