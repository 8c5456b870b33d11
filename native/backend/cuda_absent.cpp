// Placeholder: the symbols of cuda.cu for builds without CUDA.
namespace vlp {
int cuda_device_count();
int cuda_device_count() { return 0; }
} // namespace vlp
