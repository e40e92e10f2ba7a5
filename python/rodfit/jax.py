"""Residuals and misfits of rodfit in JAX, with exact derivatives::

    import jax, rodfit, rodfit.jax
    jax.config.update("jax_enable_x64", True)
    r = fit.residuals()
    misfit = rodfit.jax.misfit(r)
    jax.grad(misfit)(r.x0), jax.hessian(misfit)(r.x0)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable

import jax
import jax.numpy as jnp
import numpy as np

from ._errors import refused

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ._residuals import Residuals


def residuals(r: Residuals) -> Callable[[jax.Array], jax.Array]:
    """The residuals as a JAX function, with first derivatives: ``jacfwd``, ``jacrev``, ``jit`` and ``vmap`` work. For
    second derivatives use ``misfit``."""
    _check_precision()
    n, m = len(r.names), len(r)
    jac = _callback(r.jac, (m, n))

    @jax.custom_jvp
    def fun(x: jax.Array) -> jax.Array:
        return _callback(r, (m,))(x)

    @fun.defjvp
    def _(primals: tuple[jax.Array], tangents: tuple[jax.Array]) -> tuple[jax.Array, jax.Array]:
        (x,), (dx,) = primals, tangents
        return fun(x), jac(x) @ dx

    return fun


def misfit(r: Residuals) -> Callable[[jax.Array], jax.Array]:
    """Half the sum of the squared residuals as a JAX function with exact ``grad`` and ``hessian``."""
    _check_precision()
    n = len(r.names)
    hess = _callback(r.hess, (n, n))

    @jax.custom_jvp
    def slope(x: jax.Array) -> jax.Array:
        return _callback(lambda x: r.jac(x).T @ r(x), (n,))(x)

    @slope.defjvp
    def _(primals: tuple[jax.Array], tangents: tuple[jax.Array]) -> tuple[jax.Array, jax.Array]:
        (x,), (dx,) = primals, tangents
        return slope(x), hess(x) @ dx

    @jax.custom_jvp
    def fun(x: jax.Array) -> jax.Array:
        return _callback(lambda x: 0.5 * np.sum(r(x) ** 2), ())(x)

    @fun.defjvp
    def _(primals: tuple[jax.Array], tangents: tuple[jax.Array]) -> tuple[jax.Array, jax.Array]:
        (x,), (dx,) = primals, tangents
        return fun(x), slope(x) @ dx

    return fun


def _callback(function: Callable[[NDArray[np.float64]], ArrayLike], shape: tuple[int, ...]) -> Callable[[jax.Array], jax.Array]:
    """A numpy function as a JAX function without derivatives."""
    returned: Any = jnp.empty(shape, jnp.float64)

    def call(x: jax.Array) -> jax.Array:
        found: jax.Array = jax.pure_callback(
            lambda x: np.asarray(function(np.asarray(x))), returned, x, vmap_method="sequential"
        )
        return found

    return call


def _check_precision() -> None:
    if jnp.zeros(1).dtype != np.float64:
        raise refused("jax_enable_x64", "False", 'jax.config.update("jax_enable_x64", True) before')
